// worker.js: the Worker in which Clamor makes keyframes and renders, ahead of what the worklets play.
//
// It receives {id, call, inputs} from player.js and answers {id, result} or {id, error, code}. `call` is a
// function of clamor.h, whose context it adds, or one of `own`.
import createClamor from "./clamor.mjs";
import {Native} from "./native.js";

const kBlockFrames = 512;
const kLoadingSeconds = 0.004;  // for pages and sounds, at each block

let native, context;
let changed = false;  // since the last commit
const feeds = new Map();

// Renders what one listener hears and posts it to its worklet, `lead_frames` ahead of what was played.
class Feed {
  constructor(listener, {port, channels, lead_frames, offline}) {
    Object.assign(this, {listener, port, channels, lead_frames, offline, sent: 0, played: 0});
    this.planes = native.module._malloc(4 * (kBlockFrames + 1) * channels);
    this.table = this.planes + 4 * kBlockFrames * channels;
    for (let i = 0; i < channels; ++i)
      native.view.setUint32(this.table + 4 * i, this.planes + 4 * kBlockFrames * i, true);
    port.onmessage = ({data}) => {
      this.played = data;
      this.pump();
    };
  }

  pump() {
    while (this.sent - this.played < this.lead_frames) this.send();
  }

  send() {
    if (this.offline) this.make_keyframes();
    else update(kLoadingSeconds);
    native.module._clamor_render_planar(context, this.listener, this.table, kBlockFrames);
    const block = native.module.HEAPF32.slice(this.planes / 4, this.planes / 4 + kBlockFrames * this.channels);
    this.port.postMessage({block, channels: this.channels}, [block.buffer]);
    this.sent += kBlockFrames;
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

function names(level, count, call) {
  return Array.from({length: count}, (_, i) => native.call(call, context, level, i));
}

const own = {
  async create({wasm, options, url}) {
    const log = (sentence) => postMessage({log: sentence});
    native = new Native(await createClamor({locateFile: () => url, wasmBinary: wasm}));
    const told = native.module.addFunction((_, text) => log(native.module.UTF8ToString(text)), "vpp");
    context = native.call("clamor_create", {caller_updates: 1, log: told, ...options});
  },

  async open(source, name) {
    let bytes = source;
    if (typeof source === "string") {
      const answer = await fetch(source);
      if (!answer.ok) throw new Error(`${source}: the server answers ${answer.status} ${answer.statusText}`);
      bytes = await answer.arrayBuffer();
    }
    const level = native.open(context, bytes, name);
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
    const listener = native.call("clamor_create_listener", context, level,
      {max_block_frames: kBlockFrames, ...options});
    const channels = native.call("clamor_get_channels", context, listener);
    feeds.set(listener, new Feed(listener, {port, channels, lead_frames, offline: options.offline}));
    return {listener, channels};
  },

  start(listener) {
    feeds.get(listener).pump();
  },

  // Renders that much ahead, for an OfflineAudioContext.
  prepare(listener, frames, poses) {
    const feed = feeds.get(listener);
    feed.poses = poses;
    while (feed.sent < frames) feed.send();
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
