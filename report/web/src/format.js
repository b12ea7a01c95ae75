const superscript = (n) => String(n).replace("-", "⁻").replace(/\d/g, (d) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[d]);
export const power = (n) => `10${superscript(n)}`;

/** A text of the program with minus signs: "by -0.1 per s" -> "by −0.1 per s". */
export const minus = (text) => text.replace(/(^|[\s(])-(?=\d)/g, "$1−");

/** 50000 -> "50 000" with narrow spaces. */
export function grouped(n) {
  const [whole, part] = String(n).split(".");
  return whole.replace(/\B(?=(\d{3})+(?!\d))/g, "\u202f") + (part ? `.${part}` : "");
}

/** A number for people: 0.2857, 20 000, 2.26 × 10⁻¹⁵. */
export function number(x, digits = 3) {
  if (x === null || x === undefined || Number.isNaN(x)) return "–";
  if (!Number.isFinite(x)) return x > 0 ? "∞" : "−∞";
  if (x === 0) return "0";
  const sign = x < 0 ? "−" : "", a = Math.abs(x);
  if (a >= 1e-3 && a < 1e7) {
    const text = a >= 10 ** (digits - 1) && a < 1e7 ? String(Math.round(a * 10) / 10) : String(Number(a.toPrecision(digits)));
    return sign + grouped(a >= 1000 ? String(Math.round(a)) : text);
  }
  const [m, e] = a.toExponential(Math.max(0, digits - 1)).split("e");
  return sign + (Number(m) === 1 ? "" : `${Number(m)} × `) + power(Number(e));
}

/** The same shorter, for axes: 2e-16 -> "2×10⁻¹⁶", 1e-16 -> "10⁻¹⁶". */
export function short(x) {
  if (x === 0) return "0";
  const a = Math.abs(x), sign = x < 0 ? "−" : "";
  if (a >= 1e-3 && a < 1e6) return sign + grouped(Number(a.toPrecision(6)));
  const [m, e] = a.toExponential(3).split("e");
  return sign + (Number(m) === 1 ? "" : `${Number(m)}×`) + power(Number(e));
}

const units = [["s", 1, 7200], ["h", 3600, 2 * 86400], ["d", 86400, 3 * 365.25 * 86400], ["y", 365.25 * 86400, Infinity]];
/** The unit that suits times up to `last` seconds: {name, seconds}. */
export function timeUnit(last) {
  const [name, seconds] = units.find((u) => last <= u[2]);
  return { name, seconds };
}

/** An instant of a span from 0 to `last` seconds, with digits for a thousandth of it: "8 h 20 min 05 s", "12.50 s". */
export function instant(t, last, span) {
  const { name, seconds } = timeUnit(last), two = (x) => String(x).padStart(2, "0");
  if (name === "h") {
    const all = Math.round(t);
    return `${Math.floor(all / 3600)} h ${two(Math.floor(all / 60) % 60)} min ${two(all % 60)} s`;
  }
  const digits = seconds === 1 ? Math.max(1, 2 - Math.floor(Math.log10(span))) : Math.max(2, 3 - Math.floor(Math.log10(span / seconds)));
  return `${(t / seconds).toFixed(digits)} ${name}`;
}

/** Of a judged trajectory in place of its steps: "124 rows, 0.477 s apart in the mean". As rows_words() of the program. */
export function rowsOf(s) {
  const mean = s.simulated_s / s.steps, equal = Math.abs(mean - s.step_s) < 1e-6 * mean;
  return `${grouped(s.steps + 1)} rows, ${number(mean, equal ? 6 : 3)} s apart${equal ? "" : " in the mean"}`;
}

/** A time in words: "2 h 46 min", "12.5 s". */
export function duration(s) {
  if (s < 120) return `${number(s)} s`;
  const two = (big, small, seconds) => {
    const n = Math.round(s / seconds), per = 60, rest = n % per;
    return `${Math.floor(n / per)} ${big}${rest ? ` ${rest} ${small}` : ""}`;
  };
  if (s < 7200) return two("min", "s", 1);
  if (s < 2 * 86400) return two("h", "min", 60);
  if (s < 3 * 365.25 * 86400) return `${number(s / 86400, 4)} d`;
  return `${number(s / 365.25 / 86400, 4)} y`;
}
