"use strict";
// Range of a logarithmic axis for some curves, which are shape lists of amplitudes; null without any. It holds all of them,
// but for predictions below a hundredth of all measurements, which `within` leaves out: a model without friction has no
// third harmonic at all.
function logScale(measured, predicted) {
  const ends = (values) => values.reduce(([low, high], value) => (value > 0 ? [Math.min(low, value), Math.max(high, value)] : [low, high]), [Infinity, 0]);
  const least = measured.flat().some((value) => value > 0) ? ends(measured.flat())[0] / 100 : 0;
  const [low, high] = ends([...measured, ...predicted].flat().filter((value) => value >= least));
  return high > 0 ? { least, range: [Math.log10(low) - 0.1, Math.log10(high) + 0.08] } : null;
}
const within = (scale, amplitude) => (scale ? amplitude.map((value) => (value >= scale.least ? value : null)) : amplitude);
// Whole numbers at such an axis, as many as there is room for: of a decade's 2 and 5 alone nobody sees the decade.
function logTicks([low, high], write) {
  const span = high - low, fine = [1, 1.2, 1.5, 2, 2.5, 3, 3.5, 4, 5, 6, 7, 8];
  const steps = span < 0.6 ? fine : span < 1.2 ? [1, 1.5, 2, 3, 4, 5, 7] : span < 2.5 ? [1, 2, 5] : [1], values = [];
  for (let decade = Math.floor(low); decade <= high; decade++) values.push(...steps.map((step) => step * 10 ** decade));
  const seen = values.filter((value) => Math.log10(value) >= low && Math.log10(value) <= high);
  return { tickvals: seen, ticktext: seen.map((value) => write(value)) };
}
