#pragma once

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/core/rate_policy.hpp>
#include <boost/beast/http/fields.hpp>
#include <boost/beast/websocket/teardown.hpp>
#include <concepts>
#include <cstddef>
#include <memory>
#include <optional>
#include <utility>

namespace mocap::web {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
namespace websocket = boost::beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

/// A completion handler of any type. Beast's operations have long types: with this type the operations of the socket
/// and of TLS are compiled once instead of once for each operation above them.
class AnyHandler {
 public:
  template <class Handler>
  requires(!std::same_as<std::decay_t<Handler>, AnyHandler>) explicit AnyHandler(Handler&& handler)
      : held_(std::make_unique<Held<std::decay_t<Handler>>>(std::forward<Handler>(handler))) {}

  void operator()(const boost::system::error_code& error, std::size_t bytes = 0) {
    std::exchange(held_, nullptr)->call(error, bytes);
  }

 private:
  struct Base {
    virtual ~Base() = default;
    virtual void call(const boost::system::error_code& error, std::size_t bytes) = 0;
  };
  template <class Handler>
  struct Held : Base {
    explicit Held(Handler&& given) : handler(std::move(given)) {}
    explicit Held(const Handler& given) : handler(given) {}
    void call(const boost::system::error_code& error, std::size_t bytes) override { std::move(handler)(error, bytes); }
    Handler handler;
  };
  std::unique_ptr<Base> held_;
};

/// A TCP connection with or without TLS. Reading is limited to 256 KiB a second, so that a flooding client costs
/// little.
class AnyStream {
 public:
  using Tcp = boost::beast::basic_stream<boost::asio::ip::tcp, boost::asio::ip::tcp::socket::executor_type,
                                         boost::beast::simple_rate_policy>;
  using executor_type = Tcp::executor_type;

  /// `tls`: nullptr: plain TCP; otherwise handshake() comes first.
  AnyStream(boost::asio::ip::tcp::socket socket, boost::asio::ssl::context* tls)
      : tcp_(std::make_unique<Tcp>(std::move(socket))) {
    constexpr std::size_t kReadLimit_bytes_s = 256 * 1024;
    tcp_->rate_policy().read_limit(kReadLimit_bytes_s);
    if (tls != nullptr) tls_ = std::make_unique<Tls>(*tcp_, *tls);
  }

  executor_type get_executor() noexcept { return tcp_->get_executor(); }
  /// Beast closes the connection and sets time limits through this layer.
  Tcp& next_layer() noexcept { return *tcp_; }
  const Tcp& next_layer() const noexcept { return *tcp_; }

  void handshake(AnyHandler handler) {
    tls_->async_handshake(boost::asio::ssl::stream_base::server, std::move(handler));
  }
  bool has_tls() const { return tls_ != nullptr; }

  template <class Buffers, class Handler>
  void async_read_some(const Buffers& buffers, Handler&& handler) {
    read(first_of(buffers), AnyHandler(std::forward<Handler>(handler)));
  }
  template <class Buffers, class Handler>
  void async_write_some(const Buffers& buffers, Handler&& handler) {
    write(first_few_of(buffers), AnyHandler(std::forward<Handler>(handler)));
  }

 private:
  using Tls = boost::asio::ssl::stream<Tcp&>;
  using Several = std::array<boost::asio::const_buffer, 4>;

  template <class Buffers>
  static boost::asio::mutable_buffer first_of(const Buffers& buffers) {
    for (auto at = boost::asio::buffer_sequence_begin(buffers); at != boost::asio::buffer_sequence_end(buffers); ++at) {
      const boost::asio::mutable_buffer buffer(*at);
      if (buffer.size() > 0) return buffer;
    }
    return {};
  }
  template <class Buffers>
  static Several first_few_of(const Buffers& buffers) {
    Several several;
    std::size_t count = 0;
    for (auto at = boost::asio::buffer_sequence_begin(buffers); at != boost::asio::buffer_sequence_end(buffers); ++at) {
      const boost::asio::const_buffer buffer(*at);
      if (buffer.size() > 0 && count < several.size()) several[count++] = buffer;
    }
    return several;
  }

  void read(boost::asio::mutable_buffer buffer, AnyHandler handler) {
    if (tls_) return tls_->async_read_some(buffer, std::move(handler));
    tcp_->async_read_some(buffer, std::move(handler));
  }
  void write(const Several& buffers, AnyHandler handler) {
    if (tls_) return tls_->async_write_some(buffers, std::move(handler));
    tcp_->async_write_some(buffers, std::move(handler));
  }

  std::unique_ptr<Tcp> tcp_;  // at a constant address, to which tls_ refers
  std::unique_ptr<Tls> tls_;
};

/// For Beast, at the end of a WebSocket: no data follow.
inline void teardown(boost::beast::role_type /*role*/, AnyStream& stream, boost::system::error_code& error) {
  stream.next_layer().socket().shutdown(boost::asio::ip::tcp::socket::shutdown_send, error);
}
template <class Handler>
void async_teardown(boost::beast::role_type role, AnyStream& stream, Handler&& handler) {
  boost::system::error_code error;
  teardown(role, stream, error);
  boost::asio::post(stream.get_executor(), [error, held = std::forward<Handler>(handler)]() mutable { held(error); });
}

}  // namespace mocap::web
