-- wav_file.lua: writes WAV files of 32-bit floating-point samples.
local ffi = require "ffi"

local WavFile = {}
WavFile.__index = WavFile

local function number(value, bytes)
  local text = {}
  for i = 1, bytes do
    text[i] = string.char(value % 256)
    value = math.floor(value / 256)
  end
  return table.concat(text)
end

local function header(channels, rate_hz, frames)
  local frame_bytes = 4 * channels
  return "RIFF" .. number(36 + frames * frame_bytes, 4) .. "WAVEfmt " .. number(16, 4) ..
    number(3, 2) .. number(channels, 2) .. number(rate_hz, 4) .. number(rate_hz * frame_bytes, 4) ..
    number(frame_bytes, 2) .. number(32, 2) .. "data" .. number(frames * frame_bytes, 4)
end

function WavFile.create(path, channels, rate_hz)
  local file = assert(io.open(path, "wb"))
  assert(file:write(header(channels, rate_hz, 0)))
  return setmetatable({file = file, channels = channels, rate_hz = rate_hz, frames = 0}, WavFile)
end

function WavFile:put(samples, frames)
  assert(self.file:write(ffi.string(samples, frames * self.channels * 4)))
  self.frames = self.frames + frames
end

function WavFile:close()
  self.file:seek("set", 0)
  assert(self.file:write(header(self.channels, self.rate_hz, self.frames)))
  assert(self.file:close())
end

return WavFile
