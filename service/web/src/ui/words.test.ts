import { describe, expect, it } from "vitest";
import { ago, brief, bytes, count, duration, fileName, foldersOf, share, shortPath } from "./words";

describe("numbers in words", () => {
  it("agree with what they count", () => {
    expect(count(1, "shape")).toBe("1 shape");
    expect(count(12345, "shape")).toBe("12,345 shapes");
    expect(count(2, "match", "matches")).toBe("2 matches");
  });

  it("never round an unequal descriptor up to equal", () => {
    expect(share(0.9996)).toBe("99.9 %");
    expect(share(1)).toBe("100 %");
    expect(share(0.5)).toBe("50 %");
  });

  it("have three digits", () => {
    expect(brief(0)).toBe("0");
    expect(brief(1234.5)).toBe("1230");
    expect(brief(0.000123)).toBe("1.2e-4");
  });

  it("have units", () => {
    expect(bytes(900)).toBe("900 B");
    expect(bytes(2048)).toBe("2.0 kB");
    expect(bytes(30 * 1024 ** 2)).toBe("30 MB");
  });
});

describe("times", () => {
  const now = Date.parse("2026-01-01T12:00:00Z");
  it("are counted from now", () => {
    expect(ago("2026-01-01T11:59:50Z", now)).toBe("just now");
    expect(ago("2026-01-01T11:57:00Z", now)).toBe("3 minutes ago");
    expect(ago("2025-12-30T12:00:00Z", now)).toBe("2 days ago");
  });

  it("last", () => {
    expect(duration("2026-01-01T11:59:57.5Z", null, now)).toBe("2.5 s");
    expect(duration("2026-01-01T10:00:00Z", "2026-01-01T10:02:05Z", now)).toBe("2 min 5 s");
  });
});

it("shows a file without its folders", () => {
  expect(fileName("cat/cat-01.ply")).toBe("cat-01.ply");
});

describe("paths", () => {
  it("have folders, each with all before it", () => {
    expect(foldersOf("a/b/cat.ply")).toEqual(["a", "a/b"]);
    expect(foldersOf("cat.ply")).toEqual([]);
  });

  it("are short by their last two parts", () => {
    expect(shortPath("cats/cat.ply")).toBe("cats/cat.ply");
    expect(shortPath("zoo/animals/cats/cat.ply")).toBe("…/cats/cat.ply");
  });
});
