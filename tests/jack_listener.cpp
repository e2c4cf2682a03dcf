// Waits until a client of JACK's whose name begins as the argument sounds: a program of its own,
// since JACK's library cannot have clients of a server that has died and of the next in one
// process.
//
// Exit code: 0 when it sounds, 1 when it does not in ten seconds, or there is no server.
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
