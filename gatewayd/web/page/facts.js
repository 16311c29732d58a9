// Where a variable lies, and all that the mapping says of it, in words.

import { count } from "./words.js";

export function placesOn(link, variable) {
  return variable.places.filter((place) => place.link === link);
}

export function areaOf(place) {
  return place.area === "holding" ? "" : `${place.area} `;
}

export function factsOf(variable, layout) {
  const lock = variable.lock === null ? null : layout.locks[variable.lock];
  const modbus = placesOn("modbus", variable), objects = placesOn("canopen", variable);
  const others = variable.places.filter((place) => !modbus.includes(place) && !objects.includes(place));
  const input = variable.direction === "input";
  return [
    ["about", variable.comment],
    ["number", `${variable.number} (status block)`],
    ["direction", input ? "input: fieldbus to robot" : "output: robot to fieldbus"],
    ["robot", variable.robot],
    ["Modbus", modbus.map((place) => `${place.area} ${place.address} = ${place.notation}, ${place.type}`).join("; ")],
    ["CANopen", objects.map((place) => `object ${place.address}, ${place.type}, ${place.notation}`).join("; ")],
    ...others.map((place) => [place.link, `${place.area} ${place.address}, ${place.type}, ${place.notation}`]),
    ["bits", Object.entries(variable.bits ?? {}).map(([bit, words]) => `${bit} ${words}`).join(", ")],
    ["values", Object.entries(variable.meanings ?? {}).map(([value, words]) => `${value} ${words}`).join(", ")],
    ["limits", variable.limits ? `${variable.limits.join(" to ")} ${variable.unit}`.trim() : ""],
    [input ? "owner lost" : "robot lost", variable.fallback],
    ["may own", lock ? lock.owners.join(lock.takeover ? " before " : ", ") || "nobody" : ""],
    ["lease", lock && lock.lease !== null ? `${lock.lease} s` : ""],
    ["owned with", lock && lock.variables.length > 1 ? `${lock.name}: ${count(lock.variables.length, "variable")}` : ""],
  ];
}
