// The last 60 seconds of every variable, and their plots. A time without an answer is a gap, never a line.
// What was before the page was opened, or while it was hidden, comes from the gateway.

export const SECONDS = 60;

export class History {
  constructor(variables, samplesPerSecond) {
    this.length = Math.ceil(SECONDS * samplesPerSecond * 1.1);
    this.gap = 4000 / samplesPerSecond;
    this.next = 0;
    this.times = new Float64Array(this.length).fill(-Infinity);
    this.values = Array.from({ length: variables }, () => new Float64Array(this.length));
    this.good = Array.from({ length: variables }, () => new Uint8Array(this.length));
  }

  // What the gateway kept, in place of all that is here.
  refill({ period, samples }, now) {
    this.times.fill(-Infinity);
    this.next = 0;
    this.gap = Math.max(this.gap, 2.5 * period);
    for (const { age, values, quality } of samples) this.add(now - age, values, quality);
  }

  // `now` in milliseconds of performance.now().
  add(now, values, quality) {
    const at = this.next;
    this.times[at] = now;
    for (let index = 0; index < values.length; index += 1) {
      this.values[index][at] = Number(values[index]);
      this.good[index][at] = quality[index] === 0 ? 1 : 0;
    }
    this.next = (at + 1) % this.length;
  }

  range(index, now) {
    let low = Infinity, high = -Infinity;
    for (let at = 0; at < this.length; at += 1) {
      const value = this.values[index][at];
      if (now - this.times[at] > SECONDS * 1000 || !Number.isFinite(value)) continue;
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
    return low <= high ? [low, high] : [0, 0];
  }

  draw(canvas, index, now, kind) {
    const scale = devicePixelRatio || 1;
    const width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width || !height) return;
    if (canvas.width !== Math.round(width * scale)) canvas.width = Math.round(width * scale);
    if (canvas.height !== Math.round(height * scale)) canvas.height = Math.round(height * scale);
    const context = canvas.getContext("2d");
    context.setTransform(scale, 0, 0, scale, 0, 0);
    context.clearRect(0, 0, width, height);
    const style = getComputedStyle(canvas);
    const [low, high] = kind === "bool" ? [0, 1] : this.range(index, now);
    const pad = 3, span = high - low;
    const x = (time) => width * (1 - (now - time) / (SECONDS * 1000));
    const y = (value) => span > 0 ? height - pad - (height - 2 * pad) * (value - low) / span : height / 2;
    context.lineWidth = 1.5;
    context.lineJoin = "round";
    let last = null;
    for (let step = 0; step < this.length; step += 1) {
      const at = (this.next + step) % this.length;
      const time = this.times[at], value = this.values[index][at];
      if (now - time > SECONDS * 1000 + 500 || !Number.isFinite(value)) continue;
      const good = this.good[index][at];
      if (last !== null && time - last.time <= this.gap) {
        context.beginPath();
        context.strokeStyle = good ? style.color : style.outlineColor;
        context.setLineDash(good ? [] : [2, 3]);
        context.moveTo(x(last.time), y(last.value));
        context.lineTo(x(time), y(last.value));                  // a value holds until it changes
        context.lineTo(x(time), y(value));
        context.stroke();
      }
      last = { time, value };
    }
    context.setLineDash([]);
  }
}
