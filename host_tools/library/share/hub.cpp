#include "library/share/hub.hpp"

#include "libfingertip/command.hpp"

#include <algorithm>
#include <utility>

extern "C" {
#include "common/bytes.h"
}

namespace fingertip {

using std::chrono::seconds;

constexpr Hub::Client OURSELVES = 0;
/* A fingertip answers within half a second; after this long without an answer it is asked again, and has room for more commands. */
constexpr seconds PATIENCE{1};
/* Even a late answer is somebody's. */
constexpr seconds FORGOTTEN_AFTER{10};
const std::map<std::uint8_t, std::uint8_t> ANSWER_OF = {
    {WIRE_CMD_INFO, WIRE_INFO}, {WIRE_CMD_HEALTH, WIRE_HEALTH}, {WIRE_CMD_CRASH, WIRE_CRASH}};
constexpr std::size_t ACK_COMMAND_AT = 0, ACK_RESULT_AT = 1, ACK_SEQUENCE_AT = 2;

static std::optional<wire_packet> decoded(const Envelope &packet) {
  Bytes frame;
  packet.append_frame(frame);
  wire_packet decoded;
  if (wire_decode(wire_all_layouts, frame.data(), frame.size() - 1, &decoded) != FT_OK) {
    return std::nullopt;
  }
  return decoded;
}

Hub::Client Hub::join() {
  clients_[++last_client_];
  return last_client_;
}

void Hub::leave(Client client) { clients_.erase(client); }

void Hub::from_client(Client client, const std::uint8_t *bytes, std::size_t length, Time now) {
  clients_.at(client).cutter.feed(bytes, length, [&](const Bytes &frame, bool) {
    /* Damage is no command, and does not reach the line. */
    if (auto command = Envelope::opened(frame)) {
      take_command(client, std::move(*command), frame, now);
    }
  });
}

void Hub::take_command(Client client, Envelope command, const Bytes &frame, Time now) {
  if (command.version() != WIRE_VERSION) {
    /* who asks in another version is answered in it, or not at all */
    for_line_.insert(for_line_.end(), frame.begin(), frame.end());
    for_line_.push_back(0);
    return;
  }
  Command entry{client, 0, command.sequence(), command.type(), 0, 0, now};
  if (entry.type == WIRE_CMD_STREAM && command.body_length() == 1) {
    entry.wanted = *command.body();
    entry.asked = static_cast<std::uint8_t>(entry.wanted | wanted_by_others(client, now));
    *command.body() = entry.asked;
  }
  loader_wished_ = loader_wished_ || (!heard_ && entry.type == WIRE_CMD_LOADER && command.body_length() == 4 &&
                                      bytes_get_u32(command.body()) == WIRE_LOADER_MAGIC);
  send(std::move(command), entry);
}

void Hub::send(Envelope command, Command entry) {
  entry.line_sequence = line_sequence_++;
  command.set_sequence(entry.line_sequence);
  command.append_frame(for_line_);
  commands_.push_back(entry);
}

void Hub::ask(std::uint8_t type, Time now, std::uint8_t streams) {
  Bytes packet(WIRE_HEADER_BYTES);
  packet[0] = WIRE_VERSION;
  packet[1] = type;
  if (type == WIRE_CMD_STREAM) {
    packet.push_back(streams);
  }
  send(Envelope(std::move(packet)), {OURSELVES, 0, 0, type, streams, streams, now});
}

/* Also what they will once their commands, which are on their way, are done: so that none undoes
 * another's. Not what the fingertip is going to refuse. */
std::uint8_t Hub::wanted_by_others(Client client, Time now) const {
  std::uint8_t possible = WIRE_STREAM_ALL;
  if (info_) {
    possible = possible_streams(*info_, possible);
  }
  unsigned wanted = 0;
  for (const auto &[other, state] : clients_) {
    wanted |= other == client ? 0 : state.streams;
  }
  for (const Command &command : commands_) {
    bool is_on_its_way = command.type == WIRE_CMD_STREAM && now - command.sent < PATIENCE;
    if (is_on_its_way && command.client != client && clients_.count(command.client)) {
      wanted |= command.wanted & possible;
    }
  }
  return static_cast<std::uint8_t>(wanted);
}

bool Hub::is_asked(std::uint8_t type, Time now, std::optional<Client> client) const {
  return std::any_of(commands_.begin(), commands_.end(), [&](const Command &command) {
    return command.type == type && command.client == client.value_or(command.client) && now - command.sent < PATIENCE;
  });
}

bool Hub::takes_commands(Time now) const {
  auto unanswered =
      std::count_if(commands_.begin(), commands_.end(), [&](const Command &command) { return now - command.sent < PATIENCE; });
  return static_cast<std::size_t>(unanswered) < MOST_UNANSWERED;
}

void Hub::tick(Time now) {
  while (!commands_.empty() && now - commands_.front().sent > FORGOTTEN_AFTER) {
    commands_.pop_front();
  }
  if (!info_ && !is_asked(WIRE_CMD_INFO, now, OURSELVES)) {
    ask(WIRE_CMD_INFO, now);
  }
  std::uint8_t wanted = wanted_by_others(OURSELVES, now);
  if (!is_asked(WIRE_CMD_STREAM, now) && streams_ != wanted) {
    ask(WIRE_CMD_STREAM, now, wanted);
  }
}

void Hub::from_line(const std::uint8_t *bytes, std::size_t length) {
  line_.feed(bytes, length, [this](const Bytes &frame, bool joining) { take_frame(frame, joining); });
}

void Hub::take_frame(const Bytes &frame, bool joining) {
  auto packet = Envelope::opened(frame);
  if (!packet || packet->version() != WIRE_VERSION) {
    if (packet || !joining) {
      give_all(frame);
    }
    return;
  }
  heard_ = true;
  follow(packet->sequence());
  switch (packet->type()) {
  case WIRE_CONTACT: give_streaming(WIRE_STREAM_CONTACT, *packet); break;
  case WIRE_RAW: give_streaming(WIRE_STREAM_RAW, *packet); break;
  case WIRE_ACK: take_acknowledgement(std::move(*packet)); break;
  case WIRE_INFO:
  case WIRE_HEALTH:
  case WIRE_CRASH: take_answer(std::move(*packet)); break;
  default: /* of a later firmware */ give_streaming(0xFF, *packet); break;
  }
}

/* What the line lost, or a restart, is in everybody's numbers. */
void Hub::follow(std::uint16_t sequence) {
  auto ahead = static_cast<std::uint16_t>(expected_ ? sequence - *expected_ : 0);
  for (auto &[client, state] : clients_) {
    state.sequence = static_cast<std::uint16_t>(state.sequence + ahead);
  }
  expected_ = static_cast<std::uint16_t>(sequence + 1);
}

void Hub::take_acknowledgement(Envelope packet) {
  if (packet.body_length() < ACK_SEQUENCE_AT + 2) {
    return;
  }
  std::uint8_t *ack = packet.body();
  std::uint16_t line_sequence = bytes_get_u16(ack + ACK_SEQUENCE_AT);
  auto at = std::find_if(commands_.begin(), commands_.end(), [&](const Command &command) {
    return command.line_sequence == line_sequence && command.type == ack[ACK_COMMAND_AT];
  });
  if (at == commands_.end()) {
    return; /* of no client, or too late */
  }
  Command command = *at;
  commands_.erase(at);
  bool is_done = ack[ACK_RESULT_AT] == WIRE_RESULT_DONE;
  auto client = clients_.find(command.client);
  if (command.type == WIRE_CMD_STREAM && (is_done || command.client == OURSELVES)) {
    streams_ = command.asked; /* refused: there is no use in asking again */
    if (client != clients_.end()) {
      client->second.streams = command.wanted;
    }
  }
  if (is_done && ANSWER_OF.count(command.type)) {
    /* in place of one that was lost: commands are done one after the other */
    answers_[ANSWER_OF.at(command.type)] = {command.client, *expected_};
  }
  if (client != clients_.end()) {
    bytes_put_u16(ack + ACK_SEQUENCE_AT, command.sequence);
    give(command.client, packet);
  }
}

/* An answer goes to who asked. Health that does not follow the acknowledgement at once may be that
 * of the stream, with the answer lost: then it is everybody's too. */
void Hub::take_answer(Envelope packet) {
  auto at = answers_.find(packet.type());
  Client asker = OURSELVES;
  bool is_surely_the_answer = false;
  if (at != answers_.end()) {
    asker = at->second.client;
    is_surely_the_answer = at->second.sequence == packet.sequence();
    answers_.erase(at);
  }
  if (packet.type() == WIRE_INFO) {
    if (auto info = decoded(packet)) {
      info_ = info->body.info;
    }
  } else if (packet.type() == WIRE_HEALTH && !is_surely_the_answer) {
    for (auto &[client, state] : clients_) {
      if (client != asker && (state.streams & WIRE_STREAM_HEALTH)) {
        give(client, packet);
      }
    }
  }
  if (clients_.count(asker)) {
    give(asker, packet);
  }
}

void Hub::give_streaming(std::uint8_t streams, Envelope &packet) {
  for (auto &[client, state] : clients_) {
    if (state.streams & streams) {
      give(client, packet);
    }
  }
}

/* A packet that finds no room has used up its number. */
void Hub::give(Client client, Envelope &packet) {
  ClientState &state = clients_.at(client);
  packet.set_sequence(state.sequence++);
  std::size_t most = WIRE_HEADER_BYTES + packet.body_length() + WIRE_CRC_BYTES;
  if (has_room(state, most + most / 254 + 2)) {
    packet.append_frame(state.queue);
    state.lost_in_a_row = 0;
  } else {
    state.lost++;
    state.lost_in_a_row++;
  }
}

void Hub::give_all(const Bytes &frame) {
  for (auto &[client, state] : clients_) {
    if (has_room(state, frame.size() + 1)) {
      state.queue.insert(state.queue.end(), frame.begin(), frame.end());
      state.queue.push_back(0);
    }
  }
}

bool Hub::has_room(const ClientState &state, std::size_t length) const { return state.queue.size() - state.taken + length <= queue_bytes_; }

Bytes Hub::take_for_line() { return std::exchange(for_line_, {}); }

bool Hub::take_loader_wish() { return std::exchange(loader_wished_, false); }

const std::uint8_t *Hub::waiting(Client client, std::size_t *length) const {
  const ClientState &state = clients_.at(client);
  *length = state.queue.size() - state.taken;
  return state.queue.data() + state.taken;
}

void Hub::took(Client client, std::size_t length) {
  ClientState &state = clients_.at(client);
  state.taken += length;
  if (state.taken == state.queue.size()) {
    state.queue.clear();
    state.taken = 0;
  } else if (state.taken > queue_bytes_ / 2) {
    state.queue.erase(state.queue.begin(), state.queue.begin() + static_cast<std::ptrdiff_t>(state.taken));
    state.taken = 0;
  }
}

} // namespace fingertip
