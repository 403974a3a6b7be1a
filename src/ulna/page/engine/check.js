// The recorded run of `simulate`, run again here: the same bits with a processor, the same numbers without one.

function doubles(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  return new Float64Array(bytes.buffer);
}

// Σ word · (2654435761 · place | 1) modulo 2³² over the words of all numbers, in the order in which they come.
function summed() {
  const number = new Float64Array(1), words = new Uint32Array(number.buffer);
  let sum = 0, place = 0;
  return {
    add(value) {
      number[0] = value;
      for (const word of words) {
        place = (place + 1) | 0;
        sum = (sum + Math.imul(word, Math.imul(place, 0x9E3779B1) | 1)) | 0;
      }
    },
    get value() { return sum >>> 0; },
  };
}

function checked(program, facts) {
  const vector = facts.vector, rows = doubles(vector.rows), width = vector.slots.length;
  const loop = ulnaLoop(program, facts), m = loop.memory, places = vector.slots.map((slot) => program.places[slot]);
  loop.core.adapts = false;
  if (vector.noise) loop.core.given = true;
  const noise = Object.entries(vector.noise ?? {}).map(([slot, text]) => [program.places[slot], doubles(text)]);
  const inputs = vector.inputs.map(([slot, text]) => [program.places[slot], doubles(text)]);
  const sum = summed();
  let error = 0, at = null, signal = null;
  const scale = places.map((_, column) => {
    let most = 1e-300;
    for (let row = 0; row * width < rows.length; row++) most = Math.max(most, Math.abs(rows[row * width + column]));
    return most;
  });
  const largest = Math.max(...scale);
  scale.forEach((each, column) => { scale[column] = Math.max(each, 1e-6 * largest); });

  function filled(k) {
    for (const [place, values] of noise) m[place] = values[k];
    for (const [place, values] of inputs) m[place] = values[Math.min(k, values.length - 1)];
  }

  // The first sample was taken when the loop was made; take it again with what was recorded for it.
  m.fill(0);
  for (const [slot, value] of Object.entries(program.begin)) m[program.places[slot]] = value;
  for (const [slot, value] of vector.begin) m[program.places[slot]] = value;
  for (const name of vector.off) loop.core.option(m, name, 0);
  if (program.places.steps !== undefined) m[program.places.steps] = vector.steps;
  filled(0);
  loop.core.begin(m, vector.held);
  for (let k = 0; k <= vector.samples; k++) {
    if (k > 0) {
      filled(k);
      loop.step();
      if (loop.samples !== k) break;
    }
    if (k % vector.stride === 0) {
      places.forEach((place, column) => {
        const wanted = rows[(k / vector.stride) * width + column];
        error = Math.max(error, Math.abs(m[place] - wanted) / scale[column]);
        if (at === null && !Object.is(m[place], wanted)) [at, signal] = [k, vector.slots[column]];
      });
    }
    for (const place of places) sum.add(m[place]);
  }
  const complete = loop.samples === vector.samples;
  const same = complete && at === null && sum.value === vector.sum;
  return {
    same,
    close: same || (complete && error < vector.tolerance),
    error,
    samples: vector.samples,
    at,
    signal,
  };
}
