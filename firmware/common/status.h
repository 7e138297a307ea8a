/* One status type for the whole firmware: zero or positive is progress, negative is failure. Functions write their
 * outputs only when they return FT_OK. */
#pragma once

enum ft_status {
  FT_PENDING = 1,       /* started and not finished: ask again */
  FT_OK = 0,            /* done */
  FT_ERR_ARGUMENT = -1, /* a value outside its documented range */
  FT_ERR_SPACE = -2,    /* the caller's buffer or a queue is too small */
  FT_ERR_BUSY = -3,     /* an operation is still under way */
  FT_ERR_FORMAT = -4,   /* bytes that do not follow the format */
  FT_ERR_CRC = -5,      /* a check sum differs */
  FT_ERR_VERSION = -6,  /* a format version that this build does not speak */
  FT_ERR_NACK = -7,     /* no part on the bus acknowledged */
  FT_ERR_TIMEOUT = -8,  /* the hardware did not finish in its documented time */
  FT_ERR_STUCK = -9,    /* the bus is held low and recovery did not free it */
  FT_ERR_TYPE = -10,    /* an undamaged packet of a type that this build does not know */
};
