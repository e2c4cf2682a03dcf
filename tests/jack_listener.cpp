// jack_listener.cpp: waits until a client of JACK whose name starts with the argument produces
// sound. This is a separate program because JACK's library cannot have clients of a dead server and
// of its successor in one process.
//
// Exit code: 0 when the client sounds, 1 when it does not within ten seconds or there is no server.
#include "tests/player/jack_listener.h"

#include <chrono>
#include <thread>

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  clamor::testing::JackListener listener("listener");
  if (!listener.connected()) return 1;
  std::size_t heard = 0;
  for (int i = 0; i < 2000; ++i) {
    if (i % 20 == 0) listener.listen_to(argv[1]);
    for (; heard < listener.frames(); ++heard)
      if (listener.left(heard) != 0) return 0;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return 1;
}
