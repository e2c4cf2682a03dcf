// worker.js: the Worker in which Clamor makes keyframes and renders, ahead of what the worklets play.
//
// It receives {id, call, inputs} from player.js and answers {id, result} or {id, error, code}. `call` is a
// function of clamor.h, whose context it adds, or one of `own`.
import createClamor from "./clamor.mjs";
import {Native} from "./native.js";
import {RemoteBake} from "./remote_bake.js";

const kBlockFrames = 512;
const kLoadingSeconds = 0.004;  // for pages and sounds, at each block
const kMostHeldBlocks = 6;  // without an update, where blocks are late
const kLongCall_s = 0.5;

let native, context;
let changed = false;  // since the last commit
const feeds = new Map();
const remote_bakes = new Set();
const log = (sentence) => postMessage({log: sentence});

// Renders what one listener hears, `lead_frames` ahead of what its worklet has played, into memory that both share or
// into blocks that are posted.
class Feed {
  constructor(listener, {port, channels, lead_frames, long_frames, offline}) {
    Object.assign(this, {listener, port, channels, lead_frames, long_frames, offline, sent: 0, played: 0, since_update: kMostHeldBlocks});
    this.planes = native.module._malloc(4 * (kBlockFrames + 1) * channels);
    this.table = this.planes + 4 * kBlockFrames * channels;
    for (let i = 0; i < channels; ++i)
      native.view.setUint32(this.table + 4 * i, this.planes + 4 * kBlockFrames * i, true);
    this.reserve(Math.max(lead_frames, long_frames) + kBlockFrames);
    port.onmessage = ({data}) => {
      this.played = data;
      this.pump();
      for (const bake of remote_bakes) bake.read_ahead();
    };
  }

  // Makes room for that many frames between here and the worklet.
  reserve(frames) {
    const capacity = 2 ** Math.ceil(Math.log2(frames));
    if (globalThis.crossOriginIsolated && !this.offline) {
      this.ring = new Float32Array(new SharedArrayBuffer(4 * this.channels * capacity));
      this.state = new Int32Array(new SharedArrayBuffer(4));
    }
    this.capacity = capacity;
    const begins_at = this.offline ? 1 : this.lead_frames;
    this.port.postMessage({capacity, channels: this.channels, begins_at, ring: this.ring, state: this.state});
  }

  pump(lead_frames = this.lead_frames) {
    while (this.ahead < lead_frames) this.send();
  }

  get is_playing() {
    return this.played !== 0 && !this.offline;
  }

  get ahead() {
    return (this.sent - this.played) | 0;  // the worklet counts in 32 bits
  }

  send() {
    if (this.offline) this.make_keyframes();
    else this.keep_up();
    native.module._clamor_render_planar(context, this.listener, this.table, kBlockFrames);
    const planes = native.module.HEAPF32.subarray(this.planes / 4, this.planes / 4 + kBlockFrames * this.channels);
    if (this.ring) {
      for (let i = 0; i < this.channels; ++i)
        this.ring.set(planes.subarray(i * kBlockFrames, (i + 1) * kBlockFrames),
          i * this.capacity + this.sent % this.capacity);
      Atomics.store(this.state, 0, this.sent + kBlockFrames | 0);
    } else {
      const block = planes.slice();
      this.port.postMessage({block}, [block.buffer]);
    }
    this.sent += kBlockFrames;
  }

  // Where it is late, listeners rather hear the last keyframe for a moment than nothing.
  keep_up() {
    if (this.ahead < this.lead_frames / 2 && ++this.since_update < kMostHeldBlocks) return;
    this.since_update = 0;
    update(kLoadingSeconds);
  }

  // Offline, the pose of each keyframe is the last one whose time has come.
  make_keyframes() {
    for (;;) {
      const [wanted, time_s] = native.call("clamor_next_keyframe", context, this.listener);
      if (!wanted) return;
      const pose = this.poses?.findLast((each) => each.time_s <= time_s);
      if (pose) {
        const {position_m, orientation} = pose;
        native.call("clamor_move_listener", context, this.listener, {position_m, orientation});
      }
      update(0);
    }
  }

  end() {
    this.port.close();
    native.module._free(this.planes);
    feeds.delete(this.listener);
  }
}

function update(loading_s) {
  if (changed) native.call("clamor_commit", context, 0);
  changed = false;
  native.call("clamor_update", context, loading_s);
}

// Makes a call that takes long, and the first keyframe after it, which does, too. What is heard meanwhile is rendered before.
function long(call) {
  const playing = [...feeds.values()].filter((feed) => feed.is_playing);
  for (const feed of playing) feed.pump(feed.long_frames);
  const result = call();
  if (playing.length > 0) update(kLoadingSeconds);
  return result;
}

function names(level, count, call) {
  return Array.from({length: count}, (_, i) => native.call(call, context, level, i));
}

const own = {
  async create({wasm, options, url}) {
    native = new Native(await createClamor({locateFile: () => url, wasmBinary: wasm}));
    const told = native.module.addFunction((_, text) => log(native.module.UTF8ToString(text)), "vpp");
    context = native.call("clamor_create", {caller_updates: 1, log: told, ...options});
  },

  async open(source, name) {
    const bake = typeof source === "string" ? await RemoteBake.open(source) : source;
    const is_remote = bake instanceof RemoteBake;
    const level = is_remote ? native.open_with(context, bake, name, log) : native.open(context, bake, name);
    if (is_remote) remote_bakes.add(bake);
    const info = native.call("clamor_get_level_info", context, level);
    const parts = names(level, info.parts, "clamor_get_level_part");
    return {
      level, info,
      emitters: names(level, info.emitters, "clamor_get_emitter_info"),
      portals: names(level, info.portals, "clamor_get_portal_info"),
      parts: parts.map((part) => ({...native.call("clamor_get_part_info", context, part), part})),
    };
  },

  listen(level, options, {port, lead_frames}) {
    const listener = long(() => native.call("clamor_create_listener", context, level,
      {max_block_frames: kBlockFrames, ...options}));
    const channels = native.call("clamor_get_channels", context, listener);
    feeds.set(listener, new Feed(listener, {port, channels, lead_frames, long_frames: kLongCall_s * options.rate_hz, offline: options.offline}));
    return {listener, channels};
  },

  enter(listener, level) {
    long(() => native.call("clamor_enter_level", context, listener, level));
  },

  start(listener) {
    feeds.get(listener).pump();
  },

  // Renders that much ahead, for an OfflineAudioContext.
  prepare(listener, frames, poses) {
    const feed = feeds.get(listener);
    feed.poses = poses;
    feed.reserve(frames + kBlockFrames);
    while (feed.sent < frames) feed.send();
  },

  voices(listener) {
    return native.voices(context, listener);
  },

  end(listener) {
    feeds.get(listener)?.end();
    native.call("clamor_destroy_listener", context, listener);
  },

  add_sound(samples, options) {
    return native.add_sound(context, samples, options);
  },

  add_stream(rate_hz, port) {
    const sound = native.call("clamor_add_stream", context, {rate_hz});
    port.onmessage = ({data}) => {
      const at = native.keep(data);
      native.module._clamor_write_stream(context, sound, at, data.length, 0);
      native.release(at);
    };
    return sound;
  },
};

onmessage = async ({data: {id, call, inputs}}) => {
  try {
    const result = own[call] ? await own[call](...inputs) : native.call(call, context, ...inputs);
    changed ||= !call.startsWith("clamor_get");
    if (id) postMessage({id, result});
  } catch (error) {
    postMessage({id, error: error.message, code: error.code, log: id ? undefined : error.message});
  }
};
