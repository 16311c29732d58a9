// Numbers, ages and times in words.

export const QUALITIES = ["good", "stale", "unavailable", "never reported", "forced", "differs in robot", "out of range", "program not running"];
export const FORCED = 4;
export const OPERATOR = 254;
export const OPERATOR_NAME = "local operator";

export const byId = (id) => document.getElementById(id);

export function number(value, kind) {
  if (typeof value === "boolean") return value ? "1" : "0";
  if (typeof value !== "number") return String(value);          // "NaN", "Infinity"
  if (kind !== "float") return String(value);
  const size = Math.abs(value);
  if (size >= 1e7 || (size > 0 && size < 1e-4)) return value.toExponential(3);
  return value.toFixed(size >= 1000 ? 1 : size >= 10 ? 2 : 4);
}

// What a value stands for, as gatewayd/report/words.py has it: of a word of bits those that are 1.
export function meaning(value, { meanings, bits }) {
  if (!bits || typeof value !== "number") return meanings?.[Number(value)] ?? "";
  const present = [];
  for (let bit = 0, rest = value; rest > 0; bit += 1, rest = Math.floor(rest / 2)) {
    if (rest % 2) present.push(bits[bit] ?? `bit ${bit}`);
  }
  return present.join(", ") || "no bit is 1";
}

export function span(milliseconds) {
  const seconds = milliseconds / 1000;
  if (seconds < 1) return "< 1 s";
  if (seconds < 100) return `${Math.floor(seconds)} s`;
  if (seconds < 6000) return `${Math.round(seconds / 60)} min`;
  if (seconds < 172800) return `${Math.round(seconds / 3600)} h`;
  return `${Math.round(seconds / 86400)} d`;
}

export function quality(code, age) {
  const word = QUALITIES[code] ?? "unknown";
  return age === null || code > 1 ? word : `${word}, ${span(age)}`;
}

export function clock(date) {
  return date.toLocaleTimeString([], { hour: "2-digit", minute: "2-digit", second: "2-digit", hour12: false });
}

// The owner of a lock: a writer, or the operator with those who act as it, where that is known.
export function ownerName(owner, holders, writers) {
  if (owner !== OPERATOR) return writers[owner].name;
  return holders ? `operator (${printable(holders)})` : OPERATOR_NAME;
}

export function count(number, noun) {
  return `${number || "no"} ${noun}${number === 1 ? "" : "s"}`;
}

// What Unicode shows as nothing, or what turns the line round: written out, as gatewayd/report/printable.py does it elsewhere.
const HIDDEN = /[\p{C}\p{Zl}\p{Zp}\u034f\u115f\u1160\u17b4\u17b5\u180b-\u180f\u2800\u3164\ufe00-\ufe0f\uffa0\u{e0100}-\u{e01ef}]/gu;
const NAMED = { "\t": "\\t", "\n": "\\n", "\r": "\\r" };
const MAX_LENGTH = 4000;

export function printable(text) {
  const shown = text.length > MAX_LENGTH ? `${text.slice(0, MAX_LENGTH)}... (${text.length} characters)` : text;
  return shown.replace(HIDDEN, (found) => {
    if (found in NAMED) return NAMED[found];
    const code = found.codePointAt(0), digits = code.toString(16);
    return code < 256 ? `\\x${digits.padStart(2, "0")}` : code < 65536 ? `\\u${digits.padStart(4, "0")}` : `\\U${digits.padStart(8, "0")}`;
  });
}

export function make(tag, className = "", text = "") {
  const element = document.createElement(tag);
  if (className) element.className = className;
  if (text) element.textContent = printable(text);
  return element;
}

// A name that may be broken behind its underscores, and copied as it is.
export function putName(element, name) {
  const shown = printable(name);
  if (element.textContent === shown) return;
  element.replaceChildren(...shown.split(/(?<=_)(?!_)/).flatMap((part, at) => at ? [document.createElement("wbr"), part] : [part]));
}

// Writes only what has changed: the browser then has nothing to lay out anew.
export function put(element, text) {
  const shown = printable(text);
  if (element.textContent !== shown) element.textContent = shown;
}
