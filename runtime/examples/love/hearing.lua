-- hearing.lua: what the walker hears: Clamor's listener, and where its samples go.
--
-- For the ear, the library makes keyframes on threads of its own, so that a slow frame of the game
-- does not delay them, and the game keeps a queueable source filled. For a recording, the game makes
-- each keyframe with the pose of its time, so that the samples are those of `clamor render --limiter on`.
-- Both render in Hearing:play().
local ffi = require "ffi"
local clamor = require "clamor"
local WavFile = require "wav_file"

local RATE_HZ, CHANNELS = 48000, 2
local BLOCK_FRAMES, QUEUED_BLOCKS = 512, 8 -- 85 ms wait in the queue
local RECORDED_BLOCKS = 2                  -- for each frame of the game
local PEAK_DECAY = 0.93                    -- of the meters, for each frame of the game

-- ---- Where samples go: free() blocks are wanted, put() takes one --------------------------------

local Speakers = {}
Speakers.__index = Speakers

-- A source of LÖVE takes samples of 16 bits.
local function open_speakers()
  return setmetatable({
    source = love.audio.newQueueableSource(RATE_HZ, 16, CHANNELS, QUEUED_BLOCKS),
    data = love.sound.newSoundData(BLOCK_FRAMES, RATE_HZ, 16, CHANNELS)}, Speakers)
end

function Speakers:free()
  return self.source:getFreeBufferCount()
end

function Speakers:put(block, frames)
  local samples = ffi.cast("int16_t*", self.data:getFFIPointer())
  for i = 0, frames * CHANNELS - 1 do
    samples[i] = math.floor(32767 * math.max(-1, math.min(1, block[i])) + 0.5)
  end
  self.source:queue(self.data)
  self.source:play() -- it stops whenever it has run dry
end

function Speakers:close()
  self.source:stop()
end

local Recorder = {}
Recorder.__index = Recorder

local function open_recorder(path, seconds)
  return setmetatable({file = WavFile.create(path, CHANNELS, RATE_HZ),
    left = math.floor(seconds * RATE_HZ + 0.5)}, Recorder)
end

function Recorder:free()
  return self.left > 0 and RECORDED_BLOCKS or 0
end

function Recorder:put(block, frames)
  frames = math.min(frames, self.left)
  self.file:put(block, frames)
  self.left = self.left - frames
end

function Recorder:close()
  self.file:close()
end

-- ---- The listener -------------------------------------------------------------------------------

local Hearing = {}
Hearing.__index = Hearing

-- options: voices; record, a path, and seconds, how long. Nil and a sentence if the bake cannot
-- be read.
function Hearing.open(bake, options)
  local offline = options.record ~= nil
  local world = assert(clamor.new {caller_updates = offline})
  local level, failure = world:open(bake)
  if not level then return nil, failure end
  local ears, why = world:listen(level, {limits = true, offline = offline, rate_hz = RATE_HZ,
    max_block_frames = BLOCK_FRAMES, voices = options.voices})
  if not ears then return nil, why end
  return setmetatable({world = world, ears = ears, offline = offline,
    sink = offline and open_recorder(options.record, options.seconds) or open_speakers(),
    block = ffi.new("float[?]", BLOCK_FRAMES * CHANNELS), frames = 0, peaks = {0, 0}}, Hearing)
end

-- Crossfades into another bake, which a thread opens while the old one plays on.
function Hearing:enter(bake)
  self.answers = love.thread.newChannel()
  self.entering = love.thread.newThread("enter_level.lua")
  self.entering:start(self.ears:lend(), bake, self.answers)
end

-- True once another bake was entered, a sentence once that failed, and else nil.
function Hearing:entered()
  if not self.entering then return nil end
  local failure, answer = self.entering:getError(), self.answers:pop()
  if failure or answer then self.entering = nil end
  return failure or answer
end

-- Renders as many blocks as are wanted. pose_at(time_s) returns a position and a quaternion.
function Hearing:play(pose_at)
  for channel = 1, CHANNELS do self.peaks[channel] = PEAK_DECAY * self.peaks[channel] end
  if not self.offline then self.ears:move(pose_at(self:time_s())) end
  for _ = 1, self.sink:free() do
    if self.offline then
      for time_s in function() return self.ears:next_keyframe_s() end do
        self.ears:move(pose_at(time_s))
        self.world:update()
      end
    end
    self.ears:render(self.block, BLOCK_FRAMES)
    self.sink:put(self.block, BLOCK_FRAMES)
    self.frames = self.frames + BLOCK_FRAMES
    for i = 0, BLOCK_FRAMES * CHANNELS - 1 do
      local channel = i % CHANNELS + 1
      self.peaks[channel] = math.max(self.peaks[channel], math.abs(self.block[i]))
    end
  end
end

function Hearing:time_s()
  return self.frames / RATE_HZ
end

function Hearing:is_over()
  return self.sink.left == 0
end

function Hearing:close()
  if self.entering then self.entering:wait() end
  self.sink:close()
  self.world:close()
end

return Hearing
