// worklet.js: the audio thread's side: plays the blocks of worker.js, and hands it those of other nodes.

class ClamorListenerProcessor extends AudioWorkletProcessor {
  constructor() {
    super();
    this.blocks = [];
    this.received = 0;  // frames
    this.at = 0;      // in the first block
    this.played = 0;  // frames
    this.missed = 0;  // quanta without sound, since a block was late
    this.port.onmessage = ({data}) => {
      if (data === "ends") this.ends = true;
      else if (data === "how much") this.port.postMessage({queued: this.received});
      else this.connect(data);
    };
  }

  connect(port) {
    this.feed = port;
    port.onmessage = ({data: {block, channels}}) => {
      this.blocks.push(block);
      this.received += block.length / channels;
    };
  }

  process(_, [output]) {
    const frames = output[0].length;
    const channels = output.length;
    for (let done = 0; done < frames;) {
      const block = this.blocks[0];
      if (!block) {
        if (this.played > 0) this.port.postMessage({missed: ++this.missed});
        break;
      }
      const block_frames = block.length / channels;
      const count = Math.min(frames - done, block_frames - this.at);
      for (let i = 0; i < channels; ++i) {
        const begin = i * block_frames + this.at;
        output[i].set(block.subarray(begin, begin + count), done);
      }
      done += count;
      this.at += count;
      this.played += count;
      if (this.at === block_frames) {
        this.blocks.shift();
        this.at = 0;
        this.feed.postMessage(this.played);
      }
    }
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
