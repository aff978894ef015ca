#include <arpa/inet.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <random>
#include <string>
#include <thread>

#include "base/expects.h"
#include "fuzz/fuzz_arguments.h"
#include "support/temporary_folder.h"
#include "web/api.h"
#include "web/feed/page_message.h"
#include "web/http/server.h"
#include "web/query.h"

// Fuzzes what a hostile browser reaches: HTTP requests and WebSocket frames, over a real socket to a real server, and
// the readers of messages and parameters. Inputs are valid ones with bytes changed, removed and repeated. The server
// must answer a valid request after all inputs.
//
// usage: web_fuzz [COUNT [SEED]]

namespace mocap::web {
namespace {

using Random = std::mt19937_64;

std::size_t below(Random& random, std::size_t end) { return end == 0 ? 0 : random() % end; }

template <std::size_t N>
const char* one_of(Random& random, const char* const (&choices)[N]) {
  return choices[below(random, N)];
}

std::string damaged(Random& random, std::string text) {
  for (std::size_t times = below(random, 6); times > 0 && !text.empty(); --times) {
    const std::size_t place = below(random, text.size());
    switch (below(random, 4)) {
      case 0: text[place] = static_cast<char>(random()); break;
      case 1: text.erase(place, below(random, 10)); break;
      case 2: text.insert(place, text, place, below(random, 200)); break;
      default: text.insert(place, 1, static_cast<char>(random()));
    }
  }
  return text;
}

std::string request(Random& random) {
  const std::string body = one_of(random, {"", "{}", "{\"action\":\"ACTION_MARK\",\"text\":\"x\"}", "[[[["});
  std::string text = one_of(random, {"GET", "POST", "HEAD", "OPTIONS", "PUT"});
  text += std::string(" ") + one_of(random, {"/", "/metrics", "/healthz", "/api/v1/take", "/api/v1/none",
                                             "/api/v1/openapi.json", "/?token=x", "/ws", "http://a/b", "*",
                                             "/api/v1/takes", "/api/v1/takes/a%2Fb/snapshots?from_s=1&seconds=2",
                                             "/api/v1/takes/a/export?format=c3d&unit=m", "/takes/a%20b.mcap",
                                             "/takes/whole.mcap", "/api/v1/subjects/import?name=a&static=1"});
  text +=
      " HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\nAccept-Encoding: gzip\r\nCookie: "
      "mocap_token=a; b\r\n";
  text += one_of(random, {"", "Transfer-Encoding: chunked\r\n", "Expect: 100-continue\r\n",
                          "Origin: http://127.0.0.1\r\n", "Connection: close\r\n"});
  if (below(random, 20) == 0) text += "X-Long: " + std::string(9000, 'x') + "\r\n";
  const std::size_t more = below(random, 20) == 0 ? 9'000'000 : 0;  // than comes
  text += "Content-Length: " + std::to_string(body.size() + more) + "\r\n\r\n" + body;
  return text;
}

// The same request again and again, without waiting for answers.
std::string flood(Random& random) {
  const std::string one = request(random);
  std::string all;
  for (std::size_t count = 300; count > 0; --count) all += one;
  return all;
}

constexpr const char* kHandshake =
    "GET /ws HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: mocap.v1\r\n\r\n";

constexpr const char* kFoxgloveHandshake =
    "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n";

const char* page_text(Random& random) {
  return one_of(
      random,
      {"{\"op\":\"subscribe\",\"subscriptions\":[{\"id\":1,\"channelId\":1},{\"id\":2,\"channelId\":3}]}",
       "{\"op\":\"unsubscribe\",\"subscriptionIds\":[1]}", "{\"subscribe\":[\"snapshot\",\"health\",\"preview/a\"]}",
       "{\"drawn\":1}", "{\"request\":{\"id\":1,\"method\":\"none\"}}",
       "{\"request\":{\"id\":2,\"method\":\"take\",\"params\":{\"a\":[{\"b\":[]}]}}}", "[]"});
}

// Frames of RFC 6455 with the mask 0, so that the payload is readable.
std::string frames(Random& random) {
  std::string all;
  for (std::size_t count = 1 + below(random, 4); count > 0; --count) {
    const std::string payload = damaged(random, page_text(random)).substr(0, 125);
    constexpr int kOpcodes[] = {0, 1, 1, 1, 2, 8, 9, 10, 3, 15};
    all += static_cast<char>((below(random, 4) != 0 ? 0x80 : 0) | kOpcodes[below(random, std::size(kOpcodes))]);
    all += static_cast<char>(0x80U | payload.size());
    all += std::string(4, '\0') + payload;
  }
  return all;
}

// Sends bytes, and reads until the server ends the connection or is silent; returns what came.
std::string exchange(std::uint16_t port, const std::string& first, const std::string& second) {
  const int connection = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const timeval patience{30, 0};
  ::setsockopt(connection, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  std::string said;
  char block[4096];
  if (::connect(connection, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    ::send(connection, first.data(), first.size(), MSG_NOSIGNAL);
    if (!second.empty()) {
      // The server's answer to the handshake: the frames follow it.
      const ssize_t count = ::recv(connection, block, sizeof block, 0);
      if (count > 0) said.append(block, static_cast<std::size_t>(count));
      ::send(connection, second.data(), second.size(), MSG_NOSIGNAL);
    }
    ::shutdown(connection, SHUT_WR);
    for (ssize_t count = 0; (count = ::recv(connection, block, sizeof block, 0)) > 0;) {
      said.append(block, static_cast<std::size_t>(count));
    }
  }
  ::close(connection);
  return said;
}

void read_directly(Random& random) {
  const std::string text = damaged(random, page_text(random));
  static_cast<void>(read_page_message(text));
  const auto values = read_query(text);
  if (values) {
    for (const auto& [name, value] : *values) MOCAP_EXPECTS(percent_decoded(percent_encoded(value)) == value);
  }
  static_cast<void>(percent_decoded(text));
  for (const Method& method : methods()) static_cast<void>(request_of(method, text));
}

}  // namespace
}  // namespace mocap::web

int main(int argc, char** argv) {
  using namespace mocap::web;  // NOLINT: the program
  const mocap::fuzz::Arguments arguments(argc, argv);
  Random random(arguments.seed);
  ServerSettings settings;
  settings.feed = "tcp://127.0.0.1:1";  // nothing listens
  const mocap::support::TemporaryFolder takes;
  takes.write("whole.mcap", std::string(100'000, 'x'));  // no take, but a file to download
  settings.takes = takes.path();
  settings.port = 0;
  settings.accepts_hz = 1e6;
  settings.timeout_s = 5.0;
  const auto server = Server::open(settings);
  MOCAP_EXPECTS(server.has_value());
  const std::string address = (*server)->address();
  const auto port = static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1)));
  std::jthread serving([&] { (*server)->run(); });
  for (std::uint64_t tries = 0; tries < arguments.count; ++tries) {
    switch (below(random, 5)) {
      case 0: exchange(port, below(random, 100) == 0 ? flood(random) : damaged(random, request(random)), ""); break;
      case 1: exchange(port, damaged(random, kHandshake) + frames(random), ""); break;
      case 2: exchange(port, kHandshake, damaged(random, frames(random))); break;
      case 3: exchange(port, kFoxgloveHandshake, damaged(random, frames(random))); break;
      default: read_directly(random);
    }
  }
  const std::string answer = exchange(port, "GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n", "");
  std::raise(SIGTERM);
  serving.join();
  arguments.print("inputs");
  return answer.find(" 200 ") != std::string::npos ? EXIT_SUCCESS : EXIT_FAILURE;
}
