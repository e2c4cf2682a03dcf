-- enter_level.lua: a thread that opens a bake and crossfades into it, while the game goes on.
local clamor = require "clamor"

local lent, bake, answers = ...
local world, ears = clamor.borrow(lent)
local level, failure = world:open(bake)
local entered, why
if level then
  entered, why = ears:enter(level)
  level:close() -- the listener still hears it
end
answers:push(entered or failure or why)
