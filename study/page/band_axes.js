// Bands of the frequencies of one curve: a step far larger than those beside it is a gap, as in `correlation.feature.gap`.
// Two bands as far apart as 150 and 700 Hz would be two needles on one axis.
const GAP_RATIO = 5, GAP_BESIDE = 2;
function findBands(frequency) {
  const sorted = [...new Set(frequency)].sort((a, b) => a - b), step = sorted.slice(1).map((f, i) => f - sorted[i]), bands = [];
  sorted.forEach((f, i) => {
    const beside = [];
    for (let k = i - 1 - GAP_BESIDE; k <= i - 1 + GAP_BESIDE; k += 1) if (k !== i - 1 && step[k] !== undefined) beside.push(step[k]);
    if (!i || (beside.length && step[i - 1] > GAP_RATIO * Math.max(...beside))) bands.push([]);
    bands[bands.length - 1].push(f);
  });
  return bands;
}

// Bands of all curves, with their ends and number of points: curves of several levels may differ a little in frequency.
function joinBands(curves) {
  const joined = [];
  for (const piece of curves.flatMap(findBands).sort((a, b) => a[0] - b[0])) {
    const last = joined[joined.length - 1];
    if (last && piece[0] <= Math.max(...last)) piece.forEach((f) => last.add(f));
    else joined.push(new Set(piece));
  }
  return joined.map((band) => [Math.min(...band), Math.max(...band), band.size]);
}

// The points of a trace within a range of x.
function clipTrace(trace, [low, high]) {
  const keep = trace.x.map((x) => x >= low && x <= high), pick = (values) => values.filter((_, i) => keep[i]);
  const error = trace.error_y && trace.error_y.array ? { error_y: { ...trace.error_y, array: pick(trace.error_y.array) } } : {};
  return { ...trace, x: pick(trace.x), y: pick(trace.y), ...error };
}

// Traces and layout with one axis of x for each measured band, side by side.
function splitBands(traces, layout) {
  const bands = joinBands(traces.filter((trace) => trace.mode === "markers").map((trace) => trace.x));
  if (bands.length < 2) return { traces, layout };
  const apart = 0.035, room = 1 - apart * (bands.length - 1), total = bands.reduce((sum, band) => sum + band[2], 0);
  // A band of few points still has room for its ticks.
  const shares = bands.map((band) => Math.max(0.2, band[2] / total)), whole = shares.reduce((sum, share) => sum + share, 0);
  const widest = shares.indexOf(Math.max(...shares)), split = { ...layout }, parts = [];
  let begin = 0;
  bands.forEach(([low, high], number) => {
    const pad = 0.04 * (high - low || high), gap = (one, other) => (one && other ? 0.3 * (other[0] - one[1]) : Infinity);
    const range = [low - Math.min(pad, gap(bands[number - 1], bands[number])), high + Math.min(pad, gap(bands[number], bands[number + 1]))];
    const end = begin + (room * shares[number]) / whole, name = number ? number + 1 : "";
    split["xaxis" + name] = { ...layout.xaxis, domain: [begin, end], range, nticks: 6, title: number === widest ? layout.xaxis.title : undefined };
    parts.push(...traces.map((trace) => ({ ...clipTrace(trace, range), xaxis: "x" + name })));
    begin = end + apart;
  });
  return { traces: parts, layout: split };
}
