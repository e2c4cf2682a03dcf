// server.h: ClamorServer, the singleton through which the add-on's scripts use Clamor. Numbers
// stand for levels, listeners, sources and parts; 0 stands for none, and is ignored.
#pragma once

namespace clamor::godot {

void register_server();

}  // namespace clamor::godot
