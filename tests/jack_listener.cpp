// jack_listener.cpp: waits for a JACK server or, with an argument, until a client of it whose name
// starts with the argument produces sound. This is a separate program because JACK's library cannot
// have clients of a dead server and of its successor in one process.
//
// Exit code: 0 when the server is there or the client sounds, 1 when that takes more than ten
// seconds or there is no server for the client.
#include "tests/player/jack_listener.h"

#include <chrono>
#include <memory>
#include <thread>

using clamor::testing::JackListener;

int main(int argc, char** argv) {
  if (argc > 2) return 2;
  auto listener = std::make_unique<JackListener>("listener");
  for (int i = 0; i < 200 && argc == 1 && !listener->connected(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    listener = std::make_unique<JackListener>("listener");
  }
  if (!listener->connected()) return 1;
  if (argc == 1) return 0;
  std::size_t heard = 0;
  for (int i = 0; i < 2000; ++i) {
    if (i % 20 == 0) listener->listen_to(argv[1]);
    for (; heard < listener->frames(); ++heard)
      if (listener->left(heard) != 0) return 0;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return 1;
}
