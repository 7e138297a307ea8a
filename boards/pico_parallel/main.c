#include "app/app.h"
#include "pico_parallel/board.h"
#include "pico_parallel/parallel_bus.h"
#include "port/port.h"
#include "rp2040/pico.h"
#include "rp2040/sync.h"
#include "rp2040/usb_controller.h"

const bool usb_controller_has_gpio15 = false;
const unsigned sync_pin = BOARD_PIN_SYNC;

static struct parallel_bus parallel_bus;
static struct array_bus array_bus;
static struct app app;

static void on_event(void *context) { app_on_event(context); }

int main(void) {
  if (pico_start() != FT_OK || parallel_bus_init(&parallel_bus, &array_bus) != FT_OK) {
    port_panic();
  }
  port_set_event_handler(on_event, &app);
  app_start(&app, &array_bus);
  for (;;) {
    app_run(&app);
  }
}
