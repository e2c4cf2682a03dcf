-- render_walk.lua: renders a walk with LuaJIT: luajit render_walk.lua LEVEL.clamor WALK.json OUT.wav
--
-- The same samples as `clamor render LEVEL.clamor --limiter on --walk WALK.json -o OUT.wav`.
package.path = (arg[0]:match(".*/") or "./") .. "love/?.lua;" .. package.path
local ffi = require "ffi"
local clamor = require "clamor"
local Walk = require "walk"
local WavFile = require "wav_file"

local RATE_HZ, BLOCK_FRAMES = 48000, 480

if #arg ~= 3 then
  io.stderr:write("luajit render_walk.lua LEVEL.clamor WALK.json OUT.wav\n")
  os.exit(2)
end
local walk = Walk.read(arg[2])
local world = assert(clamor.new {caller_updates = true})
local level = assert(world:open(arg[1]))
local ears = assert(world:listen(level, {offline = true, limits = true, rate_hz = RATE_HZ}))
local channels = ears:channels()
local file = WavFile.create(arg[3], channels, RATE_HZ)
local block = ffi.new("float[?]", BLOCK_FRAMES * channels)

local left = math.floor(walk:length_s() * RATE_HZ + 0.5)
while left > 0 do
  for time_s in function() return ears:next_keyframe_s() end do
    local x, y, z, yaw, pitch, roll = walk:at(time_s)
    ears:move(x, y, z, Walk.orientation(yaw, pitch, roll))
    world:update()
  end
  local frames = math.min(left, BLOCK_FRAMES)
  ears:render(block, frames)
  file:put(block, frames)
  left = left - frames
end
file:close()
