// Light or dark, as the person or else their system says.

import { effect, signal } from "@preact/signals";

export type Theme = "auto" | "light" | "dark";
const NAME = "proteus-theme";

export const theme = signal<Theme>(read());

function read(): Theme {
  try {
    const stored = localStorage.getItem(NAME);
    return stored === "light" || stored === "dark" ? stored : "auto";
  } catch {
    return "auto";
  }
}

export function chooseTheme(chosen: Theme): void {
  theme.value = chosen;
  try {
    localStorage.setItem(NAME, chosen);
  } catch {
    // it holds until the next visit then
  }
}

effect(() => {
  if (theme.value === "auto") delete document.documentElement.dataset.theme;
  else document.documentElement.dataset.theme = theme.value;
});
