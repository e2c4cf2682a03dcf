// worklet.js: the audio thread's side: plays what worker.js renders, and hands it what other nodes give.

const kToldFrames = 512;  // so often the Worker hears what has played

// Reads a ring of planes, of a power of two frames, which the Worker writes itself where it can share memory; otherwise
// its blocks are written here. It begins once `begins_at` frames are there, so that the blocks after the first have their
// lead, too. Frames are counted in 32 bits.
class ClamorListenerProcessor extends AudioWorkletProcessor {
  constructor() {
    super();
    this.state = new Int32Array(1);  // frames that are written
    this.capacity = this.played = this.told = this.missed = 0;  // missed: quanta without sound, since a block was late
    this.port.onmessage = ({data}) => {
      if (data === "ends") this.ends = true;
      else if (data === "how much") this.port.postMessage({queued: this.written});
      else this.connect(data);
    };
  }

  get written() {
    return Atomics.load(this.state, 0);
  }

  connect(port) {
    this.feed = port;
    port.onmessage = ({data}) => (data.block ? this.write(data.block) : this.hold(data));
  }

  hold({capacity, channels, begins_at, ring, state}) {
    this.begins_at = begins_at;
    if (capacity <= this.capacity) return;
    const before = this.ring;
    this.ring = ring ?? new Float32Array(channels * capacity);
    for (let i = 0; before && i < channels; ++i)  // nothing has played yet
      this.ring.set(before.subarray(i * this.capacity, (i + 1) * this.capacity), i * capacity);
    this.state = state ?? this.state;
    Object.assign(this, {capacity, channels});
  }

  write(block) {
    const frames = block.length / this.channels;
    const at = this.written & (this.capacity - 1);
    for (let i = 0; i < this.channels; ++i)
      this.ring.set(block.subarray(i * frames, (i + 1) * frames), i * this.capacity + at);
    Atomics.add(this.state, 0, frames);
  }

  process(_, [output]) {
    const frames = output[0].length;
    const ahead = (this.written - this.played) | 0;
    this.has_begun ||= ahead >= this.begins_at;
    const count = this.has_begun ? Math.min(frames, ahead) : 0;
    for (let done = 0; done < count;) {
      const at = this.played & (this.capacity - 1);
      const part = Math.min(count - done, this.capacity - at);
      output.forEach((plane, i) => {
        const begin = i * this.capacity + at;
        plane.set(this.ring.subarray(begin, begin + part), done);
      });
      done += part;
      this.played = (this.played + part) | 0;
    }
    if (count < frames && this.has_begun) this.port.postMessage({missed: ++this.missed});
    if (((this.played - this.told) | 0) >= kToldFrames) this.feed.postMessage(this.told = this.played);
    return !this.ends;
  }
}

class ClamorTapProcessor extends AudioWorkletProcessor {
  constructor() {
    super();
    this.port.onmessage = ({data}) => {
      this.stream = data;
    };
  }

  process([input]) {
    if (!this.stream) return true;
    const frames = input[0]?.length ?? 128;
    const mono = new Float32Array(frames);
    for (const channel of input) channel.forEach((sample, i) => { mono[i] += sample / input.length; });
    this.stream.postMessage(mono, [mono.buffer]);
    return true;
  }
}

registerProcessor("clamor-listener", ClamorListenerProcessor);
registerProcessor("clamor-tap", ClamorTapProcessor);
