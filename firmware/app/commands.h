/* The host's commands, and the state that they set. */
#pragma once

#include "wire/packet.h"

#include <stdbool.h>
#include <stdint.h>

struct app;

struct commands {
  uint8_t streams; /* enum wire_stream, as the host has opened them */
  uint16_t osr;
  uint32_t rate_mHz;
  struct wire_ack pending; /* for what is being stored; .command 0: none */
  uint32_t done, rejected;
  uint64_t loader_at_us; /* when to leave for the boot loader; 0: not planned */
};

/* Once, after store_init: what is stored is in use. */
void commands_start(struct app *app);

/* Obeys what has arrived, at most one USB packet's worth, so that a flood of commands cannot delay the frames. Returns
 * whether anything had. */
bool commands_receive(struct app *app);

/* Each round: takes a write to the store a step further, and answers its command at the end. */
void commands_poll_store(struct app *app, uint64_t now_us);

/* The host that sent commands is gone. */
void commands_end_session(struct app *app);

/* Plans to leave for the boot loader, after a time in which the acknowledgement gets out. */
void commands_plan_loader(struct commands *commands, uint64_t now_us);
