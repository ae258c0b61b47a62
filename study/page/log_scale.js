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
