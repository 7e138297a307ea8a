/* One fingertip for many programs. The hub passes its packets to the clients that they concern, and the clients' commands to its line. To
 * each client the hub is a fingertip of its own (PROTOCOL.md). Nothing is read, written or waited for here.
 *
 * - Frames and health go to the clients that asked for them. The hub asks the fingertip for what
 *   any of them wants. A client that leaves wants nothing.
 * - A command goes on as it came, except for the streams that it asks for. Its acknowledgement, and
 *   the info or health after it, go to its client alone, under the command's own number.
 * - Packets are numbered for each client. Packet loss on the line shows to all clients. Packets
 *   that one client does not take in time are lost to that client alone. Damaged frames go to all. */
#pragma once

#include "libfingertip/clock.hpp"
#include "libfingertip/framing.hpp"

#include <cstdint>
#include <deque>
#include <map>
#include <optional>

namespace fingertip {

class Hub {
public:
  using Client = std::uint64_t; /* never the same twice */
  using Time = HostTime;

  /* What waits for a client at most: three seconds of both streams of fifteen sensors at 1308 frames/s, 336 kB/s. */
  static constexpr std::size_t QUEUE_BYTES = 1 << 20;
  /* Commands that the line has not answered in the last second, at most: a few writes of what the
   * system's serial driver takes sixteen of without waiting. */
  static constexpr std::size_t MOST_UNANSWERED = 12;
  /* Losses in a row beyond which sequence numbers, of 16 bits, show too few. */
  static constexpr std::uint64_t MOST_LOST_IN_A_ROW = 30000;

  explicit Hub(std::size_t queue_bytes = QUEUE_BYTES) : queue_bytes_(queue_bytes) {}

  Client join();
  void leave(Client client);

  void from_line(const std::uint8_t *bytes, std::size_t length);
  void from_client(Client client, const std::uint8_t *bytes, std::size_t length, Time now);
  /* While false the clients' commands are better left where they are. */
  bool takes_commands(Time now) const;
  /* Call it periodically, and after any of the above: it sends the hub's own requests. */
  void tick(Time now);

  /* Bytes for the line; they are the caller's then. */
  Bytes take_for_line();
  /* A client asked for the loader and the fingertip does not speak this version of the protocol: it
   * understands the baud rate only. Once. */
  bool take_loader_wish();

  /* Bytes for a client, and how many of them it took. */
  const std::uint8_t *waiting(Client client, std::size_t *length) const;
  void took(Client client, std::size_t length);
  /* Packets that it did not take in time. */
  std::uint64_t lost(Client client) const { return clients_.at(client).lost; }
  /* It lost too many packets in a row, and has to begin again. */
  bool is_lost_for_good(Client client) const { return clients_.at(client).lost_in_a_row > MOST_LOST_IN_A_ROW; }

  /* The last info packet of the fingertip. */
  const std::optional<wire_info> &info() const { return info_; }

private:
  struct ClientState {
    FrameCutter cutter;
    std::uint8_t streams = 0;
    std::uint16_t sequence = 0; /* of its next packet */
    Bytes queue;
    std::size_t taken = 0; /* of the queue */
    std::uint64_t lost = 0, lost_in_a_row = 0;
  };
  struct Command {
    Client client;
    std::uint16_t line_sequence, sequence; /* on the line; the client's own */
    std::uint8_t type;
    std::uint8_t wanted, asked; /* streams: by the client; of the line */
    Time sent;
  };
  struct Answer {
    Client client;
    std::uint16_t sequence; /* where nothing comes between */
  };

  void take_frame(const Bytes &frame, bool joining);
  void follow(std::uint16_t sequence);
  void take_command(Client client, Envelope command, const Bytes &frame, Time now);
  void take_acknowledgement(Envelope packet);
  void take_answer(Envelope packet);
  void ask(std::uint8_t type, Time now, std::uint8_t streams = 0);
  void send(Envelope command, Command entry);
  void give(Client client, Envelope &packet);
  void give_streaming(std::uint8_t streams, Envelope &packet);
  void give_all(const Bytes &frame);
  bool has_room(const ClientState &state, std::size_t length) const;
  std::uint8_t wanted_by_others(Client client, Time now) const;
  bool is_asked(std::uint8_t type, Time now, std::optional<Client> client = {}) const;

  std::size_t queue_bytes_;
  std::map<Client, ClientState> clients_;
  Client last_client_ = 0;
  FrameCutter line_;
  Bytes for_line_;
  std::optional<std::uint16_t> expected_;  /* number of the line's next packet */
  std::uint16_t line_sequence_ = 0;        /* of the next command */
  std::deque<Command> commands_;           /* without an acknowledgement, in order */
  std::map<std::uint8_t, Answer> answers_; /* to come, by their type */
  std::optional<std::uint8_t> streams_;    /* that the line was last asked for, and gave */
  std::optional<wire_info> info_;
  bool heard_ = false; /* a packet of this version */
  bool loader_wished_ = false;
};

} // namespace fingertip
