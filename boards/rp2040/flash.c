#include "rp2040/flash.h"

#include "port/flash.h"
#include "port/port.h"
#include "rp2040/reg.h"

#include <string.h>

/* The serial interface to the flash chip, and its chip select pad (RP2040 datasheet 4.10.13, 2.19).
 * CTRLR0 and BAUDR are written only while the interface is disabled. */
#define SSI_BASE 0x18000000u
#define SSI_CTRLR0 REG32(SSI_BASE + 0x00u)
#define SSI_CTRLR0_8_CLOCKS_A_FRAME (7u << 16) /* single lane, transmit and receive: 0 */
#define SSI_SSIENR REG32(SSI_BASE + 0x08u)
#define SSI_RXFLR REG32(SSI_BASE + 0x24u)
#define SSI_SR REG32(SSI_BASE + 0x28u)
#define SSI_SR_BUSY (1u << 0)
#define SSI_DR0 REG32(SSI_BASE + 0x60u)

#define IO_QSPI_SS_CTRL 0x4001800cu
#define IO_QSPI_SS_CTRL_OUTOVER_LOW (2u << 8)
#define IO_QSPI_SS_CTRL_OUTOVER_MASK (3u << 8)

/* W25Q16JV datasheet, chapter 8.1 */
enum command {
  COMMAND_PAGE_PROGRAM = 0x02,
  COMMAND_READ = 0x03,
  COMMAND_READ_STATUS = 0x05,
  COMMAND_WRITE_ENABLE = 0x06,
  COMMAND_SECTOR_ERASE = 0x20,
  COMMAND_UNIQUE_ID = 0x4b,
};
enum { STATUS_BUSY = 1 << 0, ID_DUMMY_BYTES = 4, HEAD_BYTES = 4 };

/* The FIFOs hold 16 frames, and 16 bytes at 31.25 MHz take 4.1 us. A poll takes 8 cycles or more. */
enum { FIFO_FRAMES = 16, EXCHANGE_POLLS = 1000 };
_Static_assert(HEAD_BYTES + PORT_FLASH_READ_BYTES <= FIFO_FRAMES, "a reading is one exchange");
/* Bytes of a page that are written at a time: 3.1 us with the head, so that no frame waits long. */
enum { SLICE_BYTES = 12 };

#define BUSY_MAX_us (FLASH_ERASE_MAX_us + 100000u)

/* The last two sectors of the 2 MiB; the linker script leaves them to the store. */
#define STORE_AT (2u * 1024 * 1024 - PORT_FLASH_SECTORS * PORT_FLASH_SECTOR_BYTES)

enum phase { PHASE_IDLE, PHASE_ENABLE, PHASE_SEND, PHASE_BUSY };

/* The operation under way */
static struct {
  enum phase phase;
  uint8_t head[HEAD_BYTES]; /* command and address */
  const uint8_t *bytes;     /* behind it */
  size_t length;            /* of both */
  size_t sent;
} operation;

/* The pad holds chip select through a whole command, whatever the FIFO does. */
static void select_chip(void) { REG32_SET(IO_QSPI_SS_CTRL) = IO_QSPI_SS_CTRL_OUTOVER_LOW; }

static void deselect_chip(void) { REG32_CLEAR(IO_QSPI_SS_CTRL) = IO_QSPI_SS_CTRL_OUTOVER_MASK; }

/* Ends what is under way, and empties the FIFOs (RP2040 datasheet 4.10.13, SSIENR). */
static void restart_interface(void) {
  SSI_SSIENR = 0;
  SSI_SSIENR = 1;
}

/* Transfers at most FIFO_FRAMES bytes both ways. */
static enum ft_status exchange(uint8_t *bytes, size_t count) {
  for (size_t i = 0; i < count; i++)
    SSI_DR0 = bytes[i];
  int polls = 0;
  while ((SSI_RXFLR < count || (SSI_SR & SSI_SR_BUSY)) && polls < EXCHANGE_POLLS)
    polls++;
  if (polls == EXCHANGE_POLLS) {
    restart_interface(); /* what comes late must not answer the next exchange */
    return FT_ERR_TIMEOUT;
  }
  for (size_t i = 0; i < count; i++)
    bytes[i] = (uint8_t)SSI_DR0;
  return FT_OK;
}

static enum ft_status run_command(uint8_t *bytes, size_t count) {
  select_chip();
  enum ft_status status = exchange(bytes, count);
  deselect_chip();
  return status;
}

static bool is_busy(void) {
  uint8_t bytes[2] = {COMMAND_READ_STATUS, 0};
  return run_command(bytes, sizeof bytes) != FT_OK || (bytes[1] & STATUS_BUSY);
}

enum ft_status flash_start(void) {
  SSI_SSIENR = 0;
  SSI_CTRLR0 = SSI_CTRLR0_8_CLOCKS_A_FRAME;
  SSI_SSIENR = 1;
  uint64_t until_us = port_now_us() + BUSY_MAX_us;
  bool busy = is_busy();
  while (busy && port_now_us() < until_us)
    busy = is_busy();
  return busy ? FT_ERR_TIMEOUT : FT_OK;
}

enum ft_status flash_read_id(uint8_t id[FLASH_ID_BYTES]) {
  uint8_t bytes[1 + ID_DUMMY_BYTES + FLASH_ID_BYTES] = {COMMAND_UNIQUE_ID};
  enum ft_status status = run_command(bytes, sizeof bytes);
  if (status == FT_OK)
    memcpy(id, bytes + 1 + ID_DUMMY_BYTES, FLASH_ID_BYTES);
  return status;
}

static void put_head(uint8_t head[HEAD_BYTES], enum command command, uint32_t at) {
  head[0] = (uint8_t)command;
  head[1] = (uint8_t)((STORE_AT + at) >> 16);
  head[2] = (uint8_t)((STORE_AT + at) >> 8);
  head[3] = (uint8_t)(STORE_AT + at);
}

static void begin(enum command command, uint32_t at, const uint8_t *bytes, size_t length) {
  put_head(operation.head, command, at);
  operation.bytes = bytes;
  operation.length = HEAD_BYTES + length;
  operation.sent = 0;
  operation.phase = PHASE_ENABLE;
}

void port_flash_erase(unsigned sector) { begin(COMMAND_SECTOR_ERASE, sector * PORT_FLASH_SECTOR_BYTES, NULL, 0); }

void port_flash_program(uint32_t at, const uint8_t *bytes, size_t length) { begin(COMMAND_PAGE_PROGRAM, at, bytes, length); }

bool flash_may_erase(void) { return operation.phase != PHASE_IDLE && operation.head[0] == COMMAND_SECTOR_ERASE; }

/* What goes wrong shows when it is read back: the rest of it is not sent. */
static void send_slice(void) {
  uint8_t bytes[SLICE_BYTES];
  size_t count = 0;
  for (; count < sizeof bytes && operation.sent < operation.length; operation.sent++)
    bytes[count++] = operation.sent < HEAD_BYTES ? operation.head[operation.sent] : operation.bytes[operation.sent - HEAD_BYTES];
  if (exchange(bytes, count) != FT_OK)
    operation.sent = operation.length;
}

bool port_flash_poll(void) {
  uint8_t write_enable = COMMAND_WRITE_ENABLE;
  switch (operation.phase) {
  case PHASE_ENABLE:
    if (run_command(&write_enable, 1) == FT_OK) /* the flash ignores what is sent without it */
      operation.phase = PHASE_SEND;
    break;
  case PHASE_SEND:
    if (operation.sent == 0)
      select_chip();
    send_slice();
    if (operation.sent == operation.length) {
      deselect_chip();
      operation.phase = PHASE_BUSY;
    }
    break;
  case PHASE_BUSY:
    if (!is_busy())
      operation.phase = PHASE_IDLE;
    break;
  default: break;
  }
  return operation.phase != PHASE_IDLE;
}

void port_flash_read(uint32_t at, uint8_t *bytes, size_t length) {
  uint8_t frame[FIFO_FRAMES] = {0};
  put_head(frame, COMMAND_READ, at);
  run_command(frame, HEAD_BYTES + length);
  memcpy(bytes, frame + HEAD_BYTES, length);
}
