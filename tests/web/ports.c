/* A libudev.so.1 for a browser under test: its serial ports are the links of the folder FINGERTIP_PORTS, each named
 * VENDOR:PRODUCT:SERIAL (hexadecimal ids of USB) and leading to a pseudo-terminal. They come and go with the links.
 *
 * Chromium asks libudev which terminals there are, takes those whose device number is a serial driver's in
 * /proc/tty/drivers (here FINGERTIP_MAJOR:FINGERTIP_MINOR), and opens the path of property DEVNAME. */
#include <dirent.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/inotify.h>
#include <unistd.h>

#define API __attribute__((visibility("default")))
#define SYSPATH "/sys/devices/fingertip_test/tty/"
enum { NAME_MAX_BYTES = 255, ID_DIGITS = 4 };

struct udev {
  int unused;
};

struct udev_list_entry {
  struct udev_list_entry *next;
  char syspath[sizeof SYSPATH + NAME_MAX_BYTES];
};

struct udev_enumerate {
  struct udev_list_entry *first;
};

struct udev_device {
  const char *action;
  char syspath[sizeof SYSPATH + NAME_MAX_BYTES];
  char devname[4096];
  char vendor[ID_DIGITS + 1];
  char product[ID_DIGITS + 1];
};

struct udev_monitor {
  int fd; /* of inotify, on the folder */
};

static const char *folder(void) {
  const char *path = getenv("FINGERTIP_PORTS");
  return path ? path : "/nonexistent";
}

static bool is_port(const char *name) {
  return name[0] != '.' && strlen(name) > 2 * (ID_DIGITS + 1) && name[ID_DIGITS] == ':' && name[2 * ID_DIGITS + 1] == ':';
}

static struct udev_device *device_of(const char *name, const char *action) {
  if (!is_port(name)) {
    return NULL;
  }
  struct udev_device *device = calloc(1, sizeof *device);
  device->action = action;
  snprintf(device->syspath, sizeof device->syspath, SYSPATH "%.*s", NAME_MAX_BYTES, name);
  snprintf(device->devname, sizeof device->devname, "%s/%s", folder(), name);
  memcpy(device->vendor, name, ID_DIGITS);
  memcpy(device->product, name + ID_DIGITS + 1, ID_DIGITS);
  return device;
}

API struct udev *udev_new(void) { return calloc(1, sizeof(struct udev)); }

API struct udev *udev_unref(struct udev *udev) {
  free(udev);
  return NULL;
}

API struct udev_enumerate *udev_enumerate_new(struct udev *udev) {
  (void)udev;
  return calloc(1, sizeof(struct udev_enumerate));
}

API int udev_enumerate_scan_devices(struct udev_enumerate *enumerate) {
  DIR *ports = opendir(folder());
  for (struct dirent *entry; ports && (entry = readdir(ports));) {
    if (is_port(entry->d_name)) {
      struct udev_list_entry *fresh = calloc(1, sizeof *fresh);
      snprintf(fresh->syspath, sizeof fresh->syspath, SYSPATH "%s", entry->d_name);
      fresh->next = enumerate->first;
      enumerate->first = fresh;
    }
  }
  if (ports) {
    closedir(ports);
  }
  return 0;
}

API struct udev_list_entry *udev_enumerate_get_list_entry(struct udev_enumerate *enumerate) { return enumerate->first; }

API struct udev_enumerate *udev_enumerate_unref(struct udev_enumerate *enumerate) {
  while (enumerate->first) {
    struct udev_list_entry *next = enumerate->first->next;
    free(enumerate->first);
    enumerate->first = next;
  }
  free(enumerate);
  return NULL;
}

API struct udev_list_entry *udev_list_entry_get_next(struct udev_list_entry *entry) { return entry->next; }

API const char *udev_list_entry_get_name(struct udev_list_entry *entry) { return entry->syspath; }

API struct udev_device *udev_device_new_from_syspath(struct udev *udev, const char *syspath) {
  (void)udev;
  return strncmp(syspath, SYSPATH, sizeof SYSPATH - 1) == 0 ? device_of(syspath + sizeof SYSPATH - 1, NULL) : NULL;
}

API struct udev_device *udev_device_unref(struct udev_device *device) {
  free(device);
  return NULL;
}

API const char *udev_device_get_action(struct udev_device *device) { return device->action; }
API const char *udev_device_get_devnode(struct udev_device *device) { return device->devname; }
API const char *udev_device_get_subsystem(struct udev_device *device) { return device ? "tty" : NULL; }
API const char *udev_device_get_syspath(struct udev_device *device) { return device->syspath; }
API const char *udev_device_get_sysname(struct udev_device *device) { return device->syspath + sizeof SYSPATH - 1; }

API const char *udev_device_get_property_value(struct udev_device *device, const char *key) {
  return strcmp(key, "DEVNAME") == 0           ? device->devname
         : strcmp(key, "MAJOR") == 0           ? getenv("FINGERTIP_MAJOR")
         : strcmp(key, "MINOR") == 0           ? getenv("FINGERTIP_MINOR")
         : strcmp(key, "ID_VENDOR_ID") == 0    ? device->vendor
         : strcmp(key, "ID_MODEL_ID") == 0     ? device->product
         : strcmp(key, "ID_SERIAL_SHORT") == 0 ? device->syspath + sizeof SYSPATH - 1 + 2 * (ID_DIGITS + 1)
                                               : NULL;
}

/* What else a browser may ask, with whatever arguments: there is nothing. */
#define NOTHING(name)                                                                                                                      \
  API void *name(void) { return NULL; }
NOTHING(udev_device_get_devtype)
NOTHING(udev_device_get_driver)
NOTHING(udev_device_get_parent)
NOTHING(udev_device_get_properties_list_entry)
NOTHING(udev_device_get_parent_with_subsystem_devtype)
NOTHING(udev_device_get_sysattr_value)
NOTHING(udev_device_new_from_devnum)
NOTHING(udev_device_new_from_subsystem_sysname)
NOTHING(udev_enumerate_add_match_subsystem)
NOTHING(udev_monitor_filter_add_match_subsystem_devtype)

API struct udev_monitor *udev_monitor_new_from_netlink(struct udev *udev, const char *name) {
  (void)udev;
  (void)name;
  struct udev_monitor *monitor = calloc(1, sizeof *monitor);
  monitor->fd = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
  return monitor;
}

API int udev_monitor_enable_receiving(struct udev_monitor *monitor) {
  inotify_add_watch(monitor->fd, folder(), IN_CREATE | IN_MOVED_TO | IN_DELETE | IN_MOVED_FROM);
  return 0;
}

API int udev_monitor_get_fd(struct udev_monitor *monitor) { return monitor->fd; }

/* One event at a time, so that those behind it keep the descriptor readable: the least room that one fits in. */
API struct udev_device *udev_monitor_receive_device(struct udev_monitor *monitor) {
  union {
    struct inotify_event event;
    char bytes[sizeof(struct inotify_event) + NAME_MAX_BYTES + 1];
  } read_in;
  ssize_t size = -1;
  for (size_t room = sizeof(struct inotify_event) + 16; room <= sizeof read_in && size < 0; room += 16) {
    size = read(monitor->fd, &read_in, room);
  }
  return size > (ssize_t)sizeof(struct inotify_event)
             ? device_of(read_in.event.name, read_in.event.mask & (IN_CREATE | IN_MOVED_TO) ? "add" : "remove")
             : NULL;
}

API struct udev_monitor *udev_monitor_unref(struct udev_monitor *monitor) {
  close(monitor->fd);
  free(monitor);
  return NULL;
}
