#include "libfingertip/error.hpp"
#include "support/host_packets.hpp"
#include "tool/doctor/crash.hpp"

#include <elf.h>
#include <gtest/gtest.h>

using namespace fingertip;

/* An ELF file with two functions: fit_frame of 0x20 bytes at 0x20001000, and a label at 0x20001100 without a size. */
static std::vector<std::uint8_t> small_elf() {
  const char names[] = "\0fit_frame\0label\0data";
  Elf32_Sym symbols[4] = {};
  symbols[1] = {1, 0x20001001, 0x20, ELF32_ST_INFO(STB_LOCAL, STT_FUNC), 0, 1};
  symbols[2] = {11, 0x20001101, 0, ELF32_ST_INFO(STB_GLOBAL, STT_FUNC), 0, 1};
  symbols[3] = {17, 0x20001010, 4, ELF32_ST_INFO(STB_GLOBAL, STT_OBJECT), 0, 1};
  Elf32_Shdr sections[2] = {};
  std::size_t at = sizeof(Elf32_Ehdr);
  sections[0].sh_type = SHT_SYMTAB;
  sections[0].sh_offset = static_cast<Elf32_Off>(at);
  sections[0].sh_size = sizeof symbols;
  sections[0].sh_link = 1;
  sections[1].sh_type = SHT_STRTAB;
  sections[1].sh_offset = static_cast<Elf32_Off>(at + sizeof symbols);
  sections[1].sh_size = sizeof names;
  Elf32_Ehdr header = {};
  std::memcpy(header.e_ident, ELFMAG, SELFMAG);
  header.e_ident[EI_CLASS] = ELFCLASS32;
  header.e_ident[EI_DATA] = ELFDATA2LSB;
  header.e_machine = EM_ARM;
  header.e_shnum = 2;
  header.e_shoff = static_cast<Elf32_Off>(at + sizeof symbols + sizeof names);
  std::vector<std::uint8_t> file;
  auto add = [&](const void *bytes, std::size_t count) {
    const auto *from = static_cast<const std::uint8_t *>(bytes);
    file.insert(file.end(), from, from + count);
  };
  add(&header, sizeof header);
  add(symbols, sizeof symbols);
  add(names, sizeof names);
  add(sections, sizeof sections);
  return file;
}

static crash_record record_of(unsigned kind) {
  crash_record record = test::make_crash(0, 0).body.crash;
  record.kind = static_cast<std::uint8_t>(kind);
  return record;
}

TEST(Symbols, Places) {
  Symbols symbols(small_elf(), "small.elf");
  EXPECT_EQ(symbols.place(0x20001000), "fit_frame+0x0");
  EXPECT_EQ(symbols.place(0x2000101e), "fit_frame+0x1e");
  EXPECT_EQ(symbols.place(0x20001020), std::nullopt);
  EXPECT_EQ(symbols.place(0x20001104), "label+0x4");
  EXPECT_EQ(symbols.place(0x20009000), std::nullopt);
  EXPECT_EQ(symbols.place(0), std::nullopt);
  EXPECT_TRUE(symbols.holds("fit_frame"));
  EXPECT_FALSE(symbols.holds("another"));
}

TEST(Symbols, EveryCutOrDamagedFileIsAnErrorOrHarmless) {
  const auto whole = small_elf();
  for (std::size_t at = 0; at < whole.size(); at++) {
    EXPECT_THROW(Symbols({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(at)}, "cut.elf"), Error) << at;
    for (unsigned mask : {0xFFu, 0x80u, 1u}) {
      auto damaged = whole;
      damaged[at] = static_cast<std::uint8_t>(damaged[at] ^ mask);
      try {
        Symbols(damaged, "damaged.elf").place(0x20001000);
      } catch (const Error &) {
      }
    }
  }
}

TEST(Crash, InWords) {
  Symbols symbols(small_elf(), "small.elf");
  EXPECT_EQ(crash_text(with_places(record_of(CRASH_FAULT), symbols)),
            "a hard fault at fit_frame+0x0 (0x20001000), called from label+0x134 (0x20001234), in "
            "the main loop, fitting, 4 min after its start");
  EXPECT_EQ(crash_text(with_places(record_of(CRASH_FAULT), std::nullopt)),
            "a hard fault at 0x20001000, called from 0x20001234, in the main loop, fitting, 4 min "
            "after its start");
  EXPECT_EQ(crash_text(with_places(record_of(CRASH_PANIC), symbols)),
            "a panic at fit_frame+0x0 (0x20001000), in the main loop, fitting, 4 min after its "
            "start");

  EXPECT_EQ(crash_text(with_places(record_of(CRASH_OVERFLOW), symbols)).substr(0, 37), "the stack overflowed at fit_frame+0x0");

  crash_record record = record_of(CRASH_WATCHDOG);
  record.stuck = CRASH_STUCK_SCAN | CRASH_STUCK_USB;
  record.exception = 16 + 23;
  record.lr = 0xfffffff9;
  record.t_us = 500000;
  EXPECT_EQ(crash_text(with_places(record, symbols)),
            "the watchdog struck: the scan of the sensors and USB made no progress; the processor was at "
            "fit_frame+0x0 (0x20001000), in interrupt 23 (I2C), the main loop fitting, 0.50 s after "
            "its start");
  record.stuck = CRASH_STUCK_INTERRUPTS;
  record.t_us = UINT64_C(86400000000) * 60;
  EXPECT_EQ(crash_text(with_places(record, symbols)),
            "the watchdog struck: nothing went on, interrupts neither, the main loop fitting, 60.0 "
            "days after its start");

  record = record_of(CRASH_EXCEPTION);
  record.vector = 16 + 20;
  EXPECT_EQ(crash_text(with_places(record, std::nullopt)).substr(0, 50), "interrupt 20 came, which has no handler, at 0x2000");
  EXPECT_EQ(crash_text(with_places(record_of(CRASH_START), std::nullopt)),
            "a start that gave up: clocks that did not come, or a fault in the start-up code");
}

TEST(Crash, WhatALaterFirmwareTellsIsToldAsNumbers) {
  crash_record record = record_of(77);
  EXPECT_EQ(crash_text(with_places(record, std::nullopt)), "an end of kind 77, which this tool does not know");
  record = record_of(CRASH_FAULT);
  record.activity = 200;
  record.event_codes[0] = 200;
  EXPECT_NE(crash_text(with_places(record, std::nullopt)).find("doing 200"), std::string::npos);
  EXPECT_EQ(events_text(record), "event 200.128 1.50 s, started 4 min");
}

TEST(Crash, EventsAndRegisters) {
  crash_record record = record_of(CRASH_FAULT);
  EXPECT_EQ(events_text(record), "command stream 1.50 s, started 4 min");
  EXPECT_EQ(registers_text(record), "r0 0x00000001 r1 0x00000000 r2 0x00000000 r3 0x00000000 r12 0x00000000 lr 0x20001235 "
                                    "xpsr 0x01000000 sp 0x20041f00");
  record.sp = 0;
  record.event_codes[0] = CRASH_EVENT_NONE;
  EXPECT_EQ(events_text(record), "");
  EXPECT_EQ(registers_text(record), "");
}
