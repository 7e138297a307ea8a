#include "app/line.h"

#include "usb/cdc.h"

void line_send(struct line *line, const struct wire_layout *layout, uint64_t t_us) {
  size_t length;
  line->packet.sequence = line->sequence++;
  line->packet.t_us = t_us;
  bool sent = false;
  if (wire_encode(layout, &line->packet, line->out, &length) == FT_OK) {
    while (length % 4 != 0) { /* whole words are queued faster; more delimiters are legal */
      line->out[length++] = 0;
    }
    sent = cdc_write(line->out, length) == FT_OK;
  }
  if (sent) {
    line->sent++;
  } else {
    line->dropped++;
  }
}
