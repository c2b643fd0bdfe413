// The parameters of a method as controls; those for experts are folded away.

import { Field } from "../../ui/basics";
import { PARAMETERS, type Parameter, type Values } from "./options";

interface Props {
  method: string;
  values: Values;
  set: (values: Values) => void;
}

export function Parameters(props: Props) {
  const all = PARAMETERS[props.method] ?? [];
  const advanced = all.filter((parameter) => parameter.isAdvanced);
  const show = (parameter: Parameter) => <Control key={parameter.name} parameter={parameter} {...props} />;
  return (
    <fieldset>
      <legend>Parameters</legend>
      <div class="parameters">{all.filter((parameter) => !parameter.isAdvanced).map(show)}</div>
      {advanced.length > 0 && (
        <details onInvalidCapture={(event) => (event.currentTarget.open = true)}>
          <summary>More of them, for experts</summary>
          <div class="parameters">{advanced.map(show)}</div>
        </details>
      )}
    </fieldset>
  );
}

function Control(props: Props & { parameter: Parameter }) {
  const { parameter, values, set } = props;
  const value = values[parameter.name] ?? parameter.usual;
  const change = (text: string) => set({ ...values, [parameter.name]: text });
  if (parameter.kind === "several") return <Several parameter={parameter} value={value} change={change} />;
  return (
    <Field label={parameter.label} hint={parameter.says}>
      {(id) => {
        const choices = parameter.kind === "switch" ? { true: "yes", false: "no" } : parameter.choices;
        if (choices === undefined) {
          return (
            <input
              id={id}
              type="number"
              {...parameter.limits}
              required={parameter.usual !== ""}
              value={value}
              onInput={(event) => change(event.currentTarget.value)}
            />
          );
        }
        return (
          <select id={id} value={value} onChange={(event) => change(event.currentTarget.value)}>
            {Object.entries(choices).map(([choice, name]) => (
              <option key={choice} value={choice}>
                {name}
              </option>
            ))}
          </select>
        );
      }}
    </Field>
  );
}

function Several(props: { parameter: Parameter; value: string; change: (text: string) => void }) {
  const { parameter, value, change } = props;
  const chosen = value.split(",").filter(Boolean);
  const names = Object.keys(parameter.choices ?? {});
  return (
    <fieldset class="field">
      <legend>{parameter.label}</legend>
      {names.map((name) => (
        <label key={name} class="tick">
          <input
            type="checkbox"
            checked={chosen.includes(name)}
            onChange={() =>
              change(names.filter((one) => (one === name ? !chosen.includes(one) : chosen.includes(one))).join(","))
            }
          />
          {parameter.choices?.[name]}
        </label>
      ))}
      <small class="quiet">{parameter.says}</small>
    </fieldset>
  );
}
