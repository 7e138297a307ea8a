#include "rp2040/flash_id.h"

#include "rp2040/ssi_regs.h"

enum {
  COMMAND_UNIQUE_ID = 0x4b,
  DUMMY_BYTES = 4,
  FRAMES = 1 + DUMMY_BYTES + FLASH_ID_BYTES, /* the FIFOs hold 16 */
  POLLS = 10000,                             /* 13 frames of 8 clocks at 31.25 MHz: 3.3 us */
};

enum ft_status flash_read_id(uint8_t id[FLASH_ID_BYTES]) {
  uint32_t execute_in_place = SSI_CTRLR0;
  SSI_SSIENR = 0;
  SSI_CTRLR0 = SSI_CTRLR0_8_CLOCKS_A_FRAME;
  SSI_SSIENR = 1;

  /* The pad holds chip select through the whole command, whatever the FIFO does. */
  REG32_SET(IO_QSPI_SS_CTRL) = IO_QSPI_SS_CTRL_OUTOVER_LOW;
  SSI_DR0 = COMMAND_UNIQUE_ID;
  for (int i = 1; i < FRAMES; i++)
    SSI_DR0 = 0;
  int polls = 0;
  while ((SSI_RXFLR < FRAMES || (SSI_SR & SSI_SR_BUSY)) && polls < POLLS)
    polls++;
  REG32_CLEAR(IO_QSPI_SS_CTRL) = IO_QSPI_SS_CTRL_OUTOVER_MASK;

  enum ft_status status = polls < POLLS ? FT_OK : FT_ERR_TIMEOUT;
  for (int i = 0; status == FT_OK && i < FRAMES; i++) {
    uint8_t byte = (uint8_t)SSI_DR0;
    if (i >= 1 + DUMMY_BYTES)
      id[i - 1 - DUMMY_BYTES] = byte;
  }

  SSI_SSIENR = 0;
  SSI_CTRLR0 = execute_in_place;
  SSI_SSIENR = 1;
  return status;
}
