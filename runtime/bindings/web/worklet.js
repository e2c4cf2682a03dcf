// worklet.js: the audio thread's side: renders, or plays what worker.js renders, and hands it what other nodes give.

// The library's clamor_render_planar(), by an instance of its module on the Worker's memory, with a stack of its own, at
// whose lower end its thread-local variables lie. It calls nothing that is imported, and waits for nothing.
class Renderer {
  constructor({module, memory, stack, stack_bytes, context, listener, table, planes, channels, block_frames}) {
    const imports = {};
    for (const {module: from, name, kind} of WebAssembly.Module.imports(module))
      (imports[from] ??= {})[name] = kind === "memory" ? memory : () => { throw new Error("the audio thread calls the system"); };
    const {exports} = new WebAssembly.Instance(module, imports);
    exports._emscripten_wasm_worker_initialize(stack, stack_bytes);
    this.render = (frames) => exports.clamor_render_planar(context, listener, table, frames);
    this.planes = Array.from({length: channels}, (_, i) => new Float32Array(memory.buffer, planes + 4 * i * block_frames, block_frames));
    this.block_frames = block_frames;
  }

  play(output) {
    const [{length}] = output;
    for (let at = 0; at < length; at += this.block_frames) {
      const frames = Math.min(this.block_frames, length - at);
      if (this.render(frames) === 0) output.forEach((plane, i) => plane.set(this.planes[i].subarray(0, frames), at));
    }
    return length;
  }
}

// A ring of planes, of a power of two frames, into which the Worker's blocks are written. Frames are counted in 32 bits.
// It plays once `begins_at` frames are there, so that the blocks after the first have their lead, too.
class Ring {
  constructor() {
    this.capacity = this.written = this.played = this.missed = 0;  // missed: quanta without sound, since a block was late
    this.begins_at = 1;
  }

  hold({capacity, channels, begins_at}) {
    this.begins_at = begins_at;
    if (capacity <= this.capacity) return;
    const before = this.planes;
    this.planes = new Float32Array(channels * capacity);
    for (let i = 0; before && i < channels; ++i)  // nothing has played yet
      this.planes.set(before.subarray(i * this.capacity, (i + 1) * this.capacity), i * capacity);
    Object.assign(this, {capacity, channels});
  }

  write(block) {
    const frames = block.length / this.channels;
    const at = this.written & (this.capacity - 1);
    for (let i = 0; i < this.channels; ++i)
      this.planes.set(block.subarray(i * frames, (i + 1) * frames), i * this.capacity + at);
    this.written = (this.written + frames) | 0;
  }

  // Returns how many frames it has played.
  play(output) {
    const [{length}] = output;
    const ahead = (this.written - this.played) | 0;
    this.has_begun ||= ahead >= this.begins_at;
    const count = this.has_begun ? Math.min(length, ahead) : 0;
    for (let done = 0; done < count;) {
      const at = this.played & (this.capacity - 1);
      const part = Math.min(count - done, this.capacity - at);
      output.forEach((plane, i) => {
        const begin = i * this.capacity + at;
        plane.set(this.planes.subarray(begin, begin + part), done);
      });
      done += part;
      this.played = (this.played + part) | 0;
    }
    if (this.has_begun && count < length) ++this.missed;
    return count;
  }
}

class ClamorListenerProcessor extends AudioWorkletProcessor {
  constructor({processorOptions: {told_frames}}) {
    super();
    this.told_frames = told_frames;  // so often the Worker hears what has played
    this.ring = new Ring();
    this.played = this.told = this.missed = 0;
    this.port.onmessage = ({data}) => {
      if (data === "ends") this.end();
      else if (data === "how much") this.port.postMessage({queued: this.ring.written});
      else this.connect(data);
    };
  }

  connect(port) {
    this.feed = port;
    port.onmessage = ({data}) => {
      if (data.block) this.ring.write(data.block);
      else if (data.module) this.renderer = new Renderer(data);
      else this.ring.hold(data);
    };
  }

  end() {
    this.ends = true;
    this.feed?.postMessage("ended");
  }

  process(_, [output]) {
    if (this.ends) return false;
    this.played = (this.played + (this.renderer ?? this.ring).play(output)) | 0;
    if (this.ring.missed > this.missed) this.port.postMessage({missed: this.missed = this.ring.missed});
    if (((this.played - this.told) | 0) >= this.told_frames) this.feed.postMessage(this.told = this.played);
    return true;
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
