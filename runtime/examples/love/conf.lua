function love.conf(t)
  t.identity = "clamor_walk"
  t.version = "11.4"
  t.window.title = "Clamor"
  t.window.width, t.window.height = 1120, 720
  t.window.resizable = true
  t.window.msaa = 4
  for _, unused in ipairs {"joystick", "physics", "touch", "video"} do t.modules[unused] = false end
end
