// worker.js: the Worker in which Clamor makes keyframes and, where worklets cannot share its memory, renders ahead of what
// they play.
//
// It receives {id, call, inputs} from player.js and answers {id, result} or {id, error, code}. `call` is a
// function of clamor.h, whose context it adds, or one of `own`.
import createClamor from "./clamor.mjs";
import {instantiate, Native} from "./native.js";
import {RemoteBake} from "./remote_bake.js";

const kBlockFrames = 512;
const kQuantumFrames = 128;  // of an AudioWorklet
const kStackBytes = 1 << 18;
const kLoadingSeconds = 0.004;  // for pages and sounds, at each block
const kMostHeldBlocks = 6;  // without an update, where blocks are late
const kLongCall_s = 0.5;

let native, context;
let shared;  // what a worklet needs for an instance of the module on the same memory
let changed = false;  // since the last commit
const feeds = new Map();
const remote_bakes = new Set();
const log = (sentence) => postMessage({log: sentence});

function load_ahead() {
  for (const bake of remote_bakes) bake.read_ahead();
}

// Planes of a block, and the table of their addresses.
function make_planes(channels, frames) {
  const planes = native.module._malloc(4 * (frames + 1) * channels);
  const table = planes + 4 * frames * channels;
  for (let i = 0; i < channels; ++i) native.view.setUint32(table + 4 * i, planes + 4 * frames * i, true);
  return {planes, table};
}

// Makes keyframes for a worklet that renders what one listener hears, by an instance of its own on this memory.
class SharedFeed {
  constructor(listener, {port, channels}) {
    this.made = make_planes(channels, kQuantumFrames);
    this.stack = native.module._malloc(kStackBytes + 16);
    Object.assign(this, {listener, port, channels});
    port.onmessage = ({data}) => {
      if (data === "ended") return this.release();
      update(kLoadingSeconds);
      load_ahead();
    };
  }

  start() {
    update(kLoadingSeconds);
    const {listener, channels, made, stack} = this;
    this.port.postMessage({...shared, ...made, context, listener, channels, block_frames: kQuantumFrames,
      stack: (stack + 15) & ~15, stack_bytes: kStackBytes});
  }

  end() {}  // until the worklet has left

  release() {
    this.port.close();
    native.release(this.made.planes);
    native.release(this.stack);
  }
}

// Renders what one listener hears, `lead_frames` ahead of what its worklet has played, into blocks that are posted.
class Feed {
  constructor(listener, {port, channels, lead_frames, long_frames, offline}) {
    Object.assign(this, {listener, port, channels, lead_frames, long_frames, offline, sent: 0, played: 0, since_update: kMostHeldBlocks});
    this.made = make_planes(channels, kBlockFrames);
    this.reserve(Math.max(lead_frames, long_frames) + kBlockFrames);
    port.onmessage = ({data}) => {
      if (data === "ended") return;
      this.played = data;
      this.pump();
      load_ahead();
    };
  }

  // Makes room for that many frames between here and the worklet.
  reserve(frames) {
    const capacity = 2 ** Math.ceil(Math.log2(frames));
    this.port.postMessage({capacity, channels: this.channels, begins_at: this.offline ? 1 : this.lead_frames});
  }

  start() {
    this.pump();
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
    const {planes, table} = this.made;
    native.module._clamor_render_planar(context, this.listener, table, kBlockFrames);
    const block = native.module.HEAPF32.slice(planes / 4, planes / 4 + kBlockFrames * this.channels);
    this.port.postMessage({block}, [block.buffer]);
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
    native.release(this.made.planes);
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
    const fetched = async () => WebAssembly.compile(await (await fetch(url)).arrayBuffer());  // of a server without its type
    const module = await (wasm ? WebAssembly.compile(wasm) : WebAssembly.compileStreaming(fetch(url)).catch(fetched));
    native = new Native(await instantiate(createClamor, module));
    shared = {module, memory: native.module.wasmMemory};
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
    const Kind = lead_frames === 0 && !options.offline ? SharedFeed : Feed;
    feeds.set(listener, new Kind(listener, {port, channels, lead_frames, long_frames: kLongCall_s * options.rate_hz, offline: options.offline}));
    return {listener, channels};
  },

  enter(listener, level) {
    long(() => native.call("clamor_enter_level", context, listener, level));
  },

  start(listener) {
    feeds.get(listener).start();
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
    feeds.delete(listener);
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
