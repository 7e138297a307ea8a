// What libfingertip makes of each input of the corpus: usage by_library JOBS.json > answers.json. corpus.py says what a job is.
#include "libfingertip/command.hpp"
#include "libfingertip/decoder.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/recording_fields.hpp"
#include "libfingertip/recording_reader.hpp"
#include "libfingertip/text.hpp"

#include <cstdio>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

using namespace fingertip;
using nlohmann::json;

struct Numbers {
  json &to;
  template <typename Value> void operator()(const std::string &name, const Value &value) { to[name] = value; }
  void operator()(const std::string &name, std::uint64_t value) {
    to[name] = name == "host_time_us" ? json(std::to_string(value)) : json(value);
  }
};

static json packet_json(const wire_packet &packet) {
  json told = {{"sequence", packet.sequence}, {"t_us", packet.t_us}};
  wire_packet copy = packet;
  if (packet.type == WIRE_CONTACT) {
    return {{"contact", recording::row_text(&packet, nullptr, 0)}};
  }
  if (packet.type == WIRE_RAW) {
    return {{"raw", recording::row_text(nullptr, &packet, packet.body.raw.sensor_count)}};
  }
  if (packet.type == WIRE_HEALTH) {
    Numbers numbers{told};
    recording::visit_health(numbers, copy.body.health);
    return {{"health", told}};
  }
  if (packet.type == WIRE_ACK) {
    Numbers numbers{told};
    recording::visit_ack(numbers, copy.body.ack);
    return {{"ack", told}};
  }
  if (packet.type == WIRE_SYNC) {
    Numbers numbers{told};
    recording::visit_sync(numbers, copy.body.sync);
    return {{"sync", told}};
  }
  if (packet.type == WIRE_INFO) {
    return {{"info", told}};
  }
  return {{"other", told}};
}

static json recording_json(const std::string &path, bool salvage, const std::string &device, const json &part) {
  json rows = json::array(), packets = json::array(), events = json::array(), info;
  const TimeSpan interval = part.is_null() ? TimeSpan() : TimeSpan{part[0], part[1]};
  RecordingReader reader(path, salvage, device, interval);
  while (auto item = reader.next()) {
    if (item->kind == RecordingReader::Item::Kind::event) {
      events.push_back(item->event);
      continue;
    }
    const wire_packet &packet = item->packet;
    json told = packet_json(packet);
    if (packet.type != WIRE_CONTACT && packet.type != WIRE_RAW) {
      packets.push_back(told);
      if (packet.type == WIRE_INFO && info.is_null()) {
        info = info_metadata(packet.body.info);
      }
    } else {
      rows.push_back(item->time_us ? json{{"time_us", fixed(*item->time_us, 1)}, {"row", told}} : told);
    }
  }
  if (!part.is_null()) {
    return {{"rows", rows}, {"has_end", reader.has_end()}, {"skipped", reader.skipped_lines()}};
  }
  return {{"rows", rows}, {"packets", packets},          {"events", events},
          {"info", info}, {"has_end", reader.has_end()}, {"skipped", reader.skipped_lines()}};
}

static json stream_json(const std::string &path) {
  std::ifstream file(path, std::ios::binary);
  const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
  json packets = json::array();
  Decoder decoder;
  decoder.feed(reinterpret_cast<const std::uint8_t *>(bytes.data()), bytes.size(), [&](const wire_packet &packet) {
    json told = packet_json(packet);
    told["frame"] = hex(frame_bytes(packet));
    if (packet.type == WIRE_INFO) {
      told["keys"] = info_metadata(packet.body.info);
    }
    packets.push_back(told);
  });
  return {{"packets", packets}, {"counts", decoder.statistics().text()}, {"other_version", decoder.other_version()}};
}

/* "osr=300" as the command that it becomes. */
static json setting_json(const std::string &text) {
  wire_info now{};
  now.slip_threshold_mm = 1;
  now.slip_window_ms = 100;
  return hex(frame_bytes(setting_commands({setting_from_text(text)}, now).at(0)));
}

static const char *kind_of(ErrorCode code) {
  switch (code) {
  case ErrorCode::not_a_recording:
  case ErrorCode::unread_kind: return "no recording";
  case ErrorCode::other_format: return "other format";
  case ErrorCode::damaged_head:
  case ErrorCode::damaged_line: return "damaged";
  case ErrorCode::several_in_file: return "several";
  case ErrorCode::no_such_in_file: return "no such";
  case ErrorCode::bad_value: return "bad value";
  default: return "other";
  }
}

template <typename Work> static json answered(const Work &work) {
  try {
    return work();
  } catch (const Error &error) {
    return {{"refused", kind_of(error.code())}, {"text", error.what()}};
  }
}

/* Why all fingertips of a file together are refused, as a reader of all of them has it; null: they are not. */
static json refusal_of_all(const std::string &path) {
  return answered([&]() -> json {
    RecordingReader reader(path, false, open_lines(path));
    while (reader.next()) {
    }
    return nullptr;
  });
}

static json answer_to(const json &job) {
  const std::string kind = job["kind"], input = job["input"], device = job["device"];
  json answer = answered([&] {
    return kind == "recording" ? recording_json(input, job["salvage"], device, job.value("part", json()))
           : kind == "stream"  ? stream_json(input)
                               : setting_json(input);
  });
  if (kind == "recording" && !device.empty() && !job["salvage"]) {
    if (json refusal = refusal_of_all(input); !refusal.is_null()) {
      answer["of_all"] = refusal;
    }
  }
  return answer;
}

int main(int count, char **words) {
  if (count != 2) {
    std::fprintf(stderr, "usage: by_library JOBS.json\n");
    return 2;
  }
  json answers = json::object();
  for (const auto &job : json::parse(std::ifstream(words[1]))) {
    answers[std::string(job["name"])] = answer_to(job);
  }
  std::printf("%s\n", answers.dump(-1, ' ', false, json::error_handler_t::replace).c_str());
}
