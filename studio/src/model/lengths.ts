/** Lengths as people read and type them. */

/** So many significant digits that a thousandth of the assembly shows. */
export function formatLength(value: number, scale: number): string {
  const digits = Math.max(0, Math.min(9, Math.ceil(-Math.log10(scale / 2000))));
  const text = value.toFixed(digits);
  return (digits ? text.replace(/\.?0+$/, "") : text).replace(/^-0$/, "0");
}

export function formatNumber(value: number, digits = 3): string {
  return value.toFixed(digits).replace(/\.?0+$/, "").replace(/^-0$/, "0");
}

/** A sum, product or fraction of numbers, as "12.5", "1/3", "2*4+1"; null for anything else. Nothing is evaluated as code. */
export function parseNumber(text: string): number | null {
  const tokens = text.trim().replaceAll(",", ".").match(/\d+\.?\d*(?:e[+-]?\d+)?|\.\d+|[-+*/()]|\S/gi) ?? [];
  let at = 0;
  const atom = (): number => {
    const token = tokens[at++];
    if (token === "-") return -atom();
    if (token === "+") return atom();
    if (token === "(") {
      const inner = sum();
      return tokens[at++] === ")" ? inner : NaN;
    }
    return token === undefined ? NaN : Number(token);
  };
  const term = (): number => {
    let result = atom();
    while (tokens[at] === "*" || tokens[at] === "/") result = tokens[at++] === "*" ? result * atom() : result / atom();
    return result;
  };
  const sum = (): number => {
    let result = term();
    while (tokens[at] === "+" || tokens[at] === "-") result = tokens[at++] === "+" ? result + term() : result - term();
    return result;
  };
  const value = sum();
  return at === tokens.length && Number.isFinite(value) ? value : null;
}

/** 1, 2 or 5 times a power of ten, at most `value`. */
export function roundDown(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value));
  return value >= 5 * power ? 5 * power : value >= 2 * power ? 2 * power : power;
}
