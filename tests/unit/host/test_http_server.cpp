/* The server and its client take turns in one thread, in simulated time. */
#include "libfingertip/clock.hpp"
#include "web/server/http_server.hpp"

#include <algorithm>
#include <arpa/inet.h>
#include <cerrno>
#include <gtest/gtest.h>
#include <stdexcept>
#include <sys/socket.h>
#include <unistd.h>

using namespace fingertip;
using namespace std::chrono_literals;

/* What a client gets that takes all there is, with such pauses, until the end. */
static std::string answered(const HttpServer::Handler &handler, std::chrono::seconds pause) {
  HttpServer server("127.0.0.1", 0, "");
  const int fd = socket(AF_INET, SOCK_STREAM, 0), ahead_bytes = 65536;
  setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &ahead_bytes, sizeof ahead_bytes);
  const timeval patience = {1, 0}; // a busy kernel moves bytes later, while simulated time would pass
  setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(server.port()));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_EQ(connect(fd, reinterpret_cast<const sockaddr *>(&address), sizeof address), 0);
  EXPECT_EQ(send(fd, "GET / HTTP/1.0\r\n\r\n", 18, 0), 18);
  std::string all, piece(1 << 20, '\0');
  HostTime next = host_now() + pause;
  server.serve(handler, [&] {
    if (host_now() < next) {
      return false;
    }
    next = host_now() + pause;
    const ssize_t count = recv(fd, piece.data(), piece.size(), 0);
    all.append(piece, 0, static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    return count == 0 || (count < 0 && errno != EAGAIN);
  });
  close(fd);
  return all;
}

TEST(HttpServer, GoesOnAsLongAsItIsRead) {
  const std::string text(4 << 20, 'a');
  const auto handler = [&](const HttpRequest &) { return HttpAnswer(200, text); };
  EXPECT_GT(answered(handler, 20s).size(), text.size());
  EXPECT_LT(answered(handler, 70s).size(), text.size());
}

TEST(HttpServer, AnswersWhereItsHandlerThrows) {
  const auto handler = [](const HttpRequest &) -> HttpAnswer { throw std::runtime_error("no memory"); };
  EXPECT_EQ(answered(handler, 1s).substr(0, 12), "HTTP/1.1 500");
}
