// What the page compiles for itself: judges.cpp, called as judges.mjs calls it, and numbers.cpp, whose numbers are the tool's.
#include "fuzz.h"
#include "libfingertip/text.hpp"
#include "line.hpp"
#include "web/wasm/judges.cpp"

#include <charconv>
#define fingertip page
#include "web/wasm/numbers.cpp"
#undef fingertip

static void check_numbers(const std::string &text) {
  FUZZ_CHECK(page::to_double(text) == to_double(text) && page::to_float(text) == to_float(text));
  FUZZ_CHECK(page::to_u64(text) == to_u64(text) && page::to_i64(text) == to_i64(text));
  const float number = to_float(text).value_or(0);
  FUZZ_CHECK(page::fixed(number, 3) == fixed(number, 3) && page::shortest(number) == shortest(number));
}

// What it answers is JSON; what it refuses, it refuses in one line.
template <typename Call> static void check(const Call &call) {
  try {
    call();
    FUZZ_CHECK(answer_bytes() == 0 || json::accept(answer_at(), answer_at() + answer_bytes()));
  } catch (const Error &error) {
    FUZZ_CHECK(*error.what() != '\0' && printable(error.what()) == error.what());
  }
}

// Without its delimiters.
static void give(Bytes line) {
  line.erase(std::remove(line.begin(), line.end(), 0), line.end());
  Bytes().swap(given); // libFuzzer's vectors leave what was shrunk poisoned
  std::copy(line.begin(), line.end(), room(static_cast<unsigned>(line.size())));
}

void fuzz_one(const uint8_t *bytes, size_t length) {
  fuzz_input input = {bytes, bytes + length};
  const std::uint8_t kind = fuzz_u8(&input) % 4;
  if (kind == 3) {
    check_numbers(std::string(input.at, input.end));
    return;
  }
  GainSession *gains = nullptr;
  PullSession *pulls = nullptr;
  given.assign(4, 'p'); // the port's name
  Examined *const doctor = kind == 2 ? doctor_begin(1, 2, 3) : nullptr;
  Bytes info;
  while (fuzz_left(&input) > 0) {
    const std::uint8_t what = fuzz_u8(&input), times = fuzz_u8(&input);
    Bytes line;
    fuzz::append_part(line, input);
    info = gains || pulls ? info : line;
    for (int i = 0; i <= times && !line.empty(); i++) {
      give(line);
      void (*const parts[])(Examined *) = {doctor_take, doctor_info, doctor_before, doctor_after, doctor_crash};
      check([&] {
        if (doctor) {
          parts[what % std::size(parts)](doctor);
        } else if (kind == 0) {
          gains ? (void)gains_take(gains) : (void)(gains = gains_begin());
        } else {
          pulls ? (void)pulls_take(pulls) : (void)(pulls = pulls_begin(1 + what / 64.0));
        }
      });
      wire_packet packet;
      if (wire_decode(wire_all_layouts, given.data(), given.size(), &packet) == FT_OK) { // the same, a little later
        packet.t_us += 30'000;
        line = fuzz::encoded(packet);
      }
    }
    check([&] { gains ? gains_status(gains) : pulls ? pulls_status(pulls) : doctor ? doctor_status(doctor) : void(); });
    give(info);
    check([&] {
      gains ? gains_result(gains, what, 1e9) : pulls ? pulls_result(pulls) : doctor ? doctor_line(doctor, 1, 1, 2, 3, 4, 5) : void();
    });
  }
  gains_free(gains);
  pulls_free(pulls);
  doctor_free(doctor);
}
