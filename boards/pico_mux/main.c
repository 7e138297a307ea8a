#include "app/app.h"
#include "pico_mux/board.h"
#include "pico_mux/mux_bus.h"
#include "port/port.h"
#include "rp2040/pico.h"
#include "rp2040/sync.h"
#include "rp2040/usb_controller.h"

const bool usb_controller_has_gpio15 = true;
const unsigned sync_pin = BOARD_PIN_SYNC;

static struct mux_bus mux_bus;
static struct array_bus array_bus;
static struct app app;

static void on_event(void *context) { app_on_event(context); }

int main(void) {
  if (pico_start() != FT_OK || mux_bus_init(&mux_bus, &array_bus) != FT_OK) {
    port_panic();
  }
  port_set_event_handler(on_event, &app);
  app_start(&app, &array_bus);
  for (;;) {
    app_run(&app);
  }
}
