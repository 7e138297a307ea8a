// The gripper clients, and whatever answers on their line: a Robotiq by Modbus, a Feetech servo.
#include "fuzz.h"
#include "grasp/gripper/feetech.hpp"
#include "grasp/gripper/robotiq.hpp"
#include "libfingertip/served_port.hpp"

#include <atomic>
#include <thread>

using namespace fingertip;
using robotiq::Bytes, robotiq::with_crc;

// A port whose other end answers as the input says, in another thread.
class Line {
public:
  const std::string &port() const { return port_.path(); }

  void begin(fuzz_input answers, bool modbus) {
    std::uint8_t rest[256];
    while (port_.read(rest, sizeof rest) > 0) { // of the run before
    }
    answers_ = answers;
    modbus_ = modbus;
    stop_ = over_ = false;
    thread_ = std::thread([this] { play(); });
  }
  void end() {
    stop_ = true;
    thread_.join();
  }
  bool over() const { return over_; }

private:
  void play() {
    while (!stop_) {
      port_.wait(host_now() + std::chrono::milliseconds(1));
      std::uint8_t question[256];
      const std::size_t length = port_.read(question, sizeof question);
      if (length == 0 || over_) {
        continue;
      }
      const Bytes answer = answer_to(Bytes(question, question + length));
      over_ = fuzz_left(&answers_) == 0;
      FUZZ_CHECK(port_.write(answer.data(), answer.size()) == answer.size());
    }
  }

  Bytes some(std::size_t length) {
    Bytes bytes;
    while (bytes.size() < length) {
      bytes.push_back(fuzz_u8(&answers_));
    }
    return bytes;
  }

  Bytes answer_to(const Bytes &question) {
    const std::uint8_t how = fuzz_u8(&answers_);
    Bytes answer = how < 0xC0 ? (modbus_ ? modbus_answer(question) : feetech_answer(question)) : some(how & 0x3F);
    if (how >= 0xA0 && how < 0xC0 && !answer.empty()) { // damaged
      answer[fuzz_u8(&answers_) % answer.size()] ^= fuzz_u8(&answers_);
    } else if (how >= 0xE0) {
      answer = modbus_ ? with_crc(answer) : answer;
    }
    return answer;
  }

  Bytes modbus_answer(const Bytes &question) {
    if (question.size() < 6) {
      return {};
    }
    Bytes answer = {question[0], question[1]};
    if (question[1] == 16) {
      answer.insert(answer.end(), question.begin() + 2, question.begin() + 6);
    } else {
      answer.push_back(static_cast<std::uint8_t>(2 * question[5]));
      const Bytes values = some(answer.back());
      answer.insert(answer.end(), values.begin(), values.end());
    }
    return with_crc(answer);
  }

  Bytes feetech_answer(Bytes question) {
    std::size_t skipped = 0;
    const auto asked = feetech::take_packet(&question, &skipped);
    if (!asked) {
      return {};
    }
    const bool reads = asked->code == feetech::READ && asked->parameters.size() == 2;
    Bytes values = reads ? some(asked->parameters[1]) : Bytes();
    if (reads && asked->parameters[0] <= feetech::OPERATING_MODE && asked->parameters[0] + asked->parameters[1] > feetech::OPERATING_MODE) {
      values[feetech::OPERATING_MODE - asked->parameters[0]] &= 1; // else it goes no further
    }
    return feetech::encoded({asked->id, fuzz_u8(&answers_), values});
  }

  ServedPort port_{""};
  fuzz_input answers_{};
  bool modbus_ = false;
  std::atomic<bool> stop_{false}, over_{false};
  std::thread thread_;
};

static void check(const GripperStatus &status, const GripperTraits &traits) {
  FUZZ_CHECK(status.width_mm >= 0 && status.width_mm <= traits.stroke_mm);
  FUZZ_CHECK(status.current_A >= 0 && status.current_A <= 1000);
}

static void talk(const std::string &port, bool modbus, fuzz_input questions, const Line &line) {
  GripperWay way;
  way.model = modbus ? "2f85" : "sts3215";
  way.port = port;
  way.timeout_s = 0.005;
  try {
    const auto gripper = open_gripper(way);
    while (fuzz_left(&questions) > 0 && !line.over()) {
      const std::uint8_t what = fuzz_u8(&questions);
      if (what < 0x40) {
        check(gripper->poll(), gripper->traits());
      } else if (what < 0xF8) {
        check(gripper->move({fuzz_u8(&questions) * 1.0, fuzz_u8(&questions) * 1.0, what * 1.0}), gripper->traits());
      } else {
        gripper->activate();
      }
      gripper->fault_text(what);
      gripper->line();
    }
  } catch (const Error &error) {
    FUZZ_CHECK(error.code() == ErrorCode::gripper_silent || error.code() == ErrorCode::gripper_garbled ||
               error.code() == ErrorCode::gripper_refused || error.code() == ErrorCode::gone);
  }
}

// Bytes to packets: in one piece or in two, the packets are the same; written, they are read again.
static void check_packets(const Bytes &bytes, std::size_t cut) {
  const auto taken = [](Bytes rest, std::vector<Bytes> &packets, std::size_t &skipped) {
    while (const auto packet = feetech::take_packet(&rest, &skipped)) {
      packets.push_back(feetech::encoded(*packet));
      Bytes again = packets.back();
      std::size_t noise = 0;
      const auto read = feetech::take_packet(&again, &noise);
      FUZZ_CHECK(packet->id == 0xFF || (read && noise == 0 && again.empty()));
    }
    return rest;
  };
  std::vector<Bytes> whole, pieces;
  std::size_t whole_skipped = 0, pieces_skipped = 0;
  const Bytes rest = taken(bytes, whole, whole_skipped);
  const auto middle = bytes.begin() + static_cast<std::ptrdiff_t>(cut % (bytes.size() + 1));
  Bytes rest_of_pieces = taken(Bytes(bytes.begin(), middle), pieces, pieces_skipped);
  rest_of_pieces.insert(rest_of_pieces.end(), middle, bytes.end());
  rest_of_pieces = taken(rest_of_pieces, pieces, pieces_skipped);
  FUZZ_CHECK(whole == pieces && rest == rest_of_pieces && whole_skipped == pieces_skipped);
  std::size_t total = whole_skipped + rest.size();
  for (const Bytes &packet : whole) {
    total += packet.size();
  }
  FUZZ_CHECK(total == bytes.size());
}

void fuzz_one(const uint8_t *bytes, size_t length) {
  fuzz_input input = {bytes, bytes + length};
  const std::uint8_t how = fuzz_u8(&input);
  if (how < 0xC0) { // most of the time: without a wait
    check_packets(Bytes(input.at, input.end), how);
    return;
  }
  static Line line;
  std::size_t asked = 16;
  const std::uint8_t *questions = fuzz_bytes(&input, &asked);
  line.begin(input, how & 1);
  talk(line.port(), how & 1, {questions, questions + asked}, line);
  line.end();
}
