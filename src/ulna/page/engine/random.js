// Random numbers of the simulator: counter-based, so that a rewound run draws the same ones again.
// splitmix64 (G. L. Steele, D. Lea, C. H. Flood, OOPSLA 2014). Uniform numbers are the simulator's to the last bit;
// normal ones use the browser's logarithm and cosine, which may differ from its library's in the last place.

const wrapped = (value) => BigInt.asUintN(64, value);

function scrambled(seed) {
  let z = wrapped((seed ^ (seed >> 33n)) * 0xFF51AFD7ED558CCDn);
  z = wrapped((z ^ (z >> 33n)) * 0xC4CEB9FE1A85EC53n);
  return z ^ (z >> 33n);
}

function uniform(seed, counter) {
  let z = wrapped(seed + 0x9E3779B97F4A7C15n * BigInt(counter + 1));
  z = wrapped((z ^ (z >> 30n)) * 0xBF58476D1CE4E5B9n);
  z = wrapped((z ^ (z >> 27n)) * 0x94D049BB133111EBn);
  z ^= z >> 31n;
  return Number(z >> 11n) * 1.1102230246251565e-16;
}

function normal(seed, counter) {
  const radius = Math.sqrt(-2.0 * Math.log(1.0 - uniform(seed, counter)));
  return radius * Math.cos(6.283185307179586 * uniform(seed, counter + 1));
}
