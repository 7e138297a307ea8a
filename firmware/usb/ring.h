/* A byte queue between one producer and one consumer in different contexts, without locks. Each side stores its own index and only reads
 * the other's, so plain atomic loads and stores suffice. Lengths and buffers that are multiples of 4 bytes are copied by words. */
#pragma once

#include <stdatomic.h>
#include <stdint.h>
#include <string.h>

struct ring {
  uint8_t *bytes;
  uint32_t size;          /* a power of two */
  _Atomic uint32_t put;   /* bytes ever put; the producer writes it */
  _Atomic uint32_t taken; /* bytes ever taken; the consumer writes it */
};

/* Producer */
static inline uint32_t ring_space(const struct ring *ring) {
  uint32_t taken = atomic_load_explicit(&ring->taken, memory_order_acquire);
  return ring->size - (atomic_load_explicit(&ring->put, memory_order_relaxed) - taken);
}

/* Producer; length is at most ring_space(). */
static inline void ring_put(struct ring *ring, const uint8_t *bytes, uint32_t length) {
  uint32_t put = atomic_load_explicit(&ring->put, memory_order_relaxed);
  uint32_t at = put & (ring->size - 1);
  uint32_t to_end = ring->size - at;
  uint32_t first = length < to_end ? length : to_end;
  memcpy(ring->bytes + at, bytes, first);
  memcpy(ring->bytes, bytes + first, length - first);
  atomic_store_explicit(&ring->put, put + length, memory_order_release);
}

/* Consumer: takes at most capacity bytes and returns how many. */
static inline uint32_t ring_take(struct ring *ring, uint8_t *bytes, uint32_t capacity) {
  uint32_t taken = atomic_load_explicit(&ring->taken, memory_order_relaxed);
  uint32_t length = atomic_load_explicit(&ring->put, memory_order_acquire) - taken;
  if (length > capacity)
    length = capacity;
  uint32_t at = taken & (ring->size - 1);
  uint32_t to_end = ring->size - at;
  uint32_t first = length < to_end ? length : to_end;
  memcpy(bytes, ring->bytes + at, first);
  memcpy(bytes + first, ring->bytes, length - first);
  atomic_store_explicit(&ring->taken, taken + length, memory_order_release);
  return length;
}

/* Consumer: drops what had been put when .put was this. Returns how many bytes. */
static inline uint32_t ring_drop(struct ring *ring, uint32_t put) {
  const uint32_t taken = atomic_load_explicit(&ring->taken, memory_order_relaxed), length = put - taken;
  if (length > ring->size)
    return 0; /* they were taken */
  atomic_store_explicit(&ring->taken, put, memory_order_release);
  return length;
}

/* Consumer: drops everything. */
static inline void ring_clear(struct ring *ring) {
  uint32_t put = atomic_load_explicit(&ring->put, memory_order_acquire);
  atomic_store_explicit(&ring->taken, put, memory_order_release);
}
