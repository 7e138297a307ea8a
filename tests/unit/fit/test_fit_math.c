#include "fit/fit_fixed.h"
#include "fit/fit_math.h"
#include "support/random.h"
#include "support/unit.h"

TEST(test_mul_q30) {
  static const int32_t corners[] = {0, 1, -1, 65535, 65536, -65535, -65536, 1 << 30, -(1 << 30), 1073741823, -1073741823, 1073676289};
  double worst = 0.0;
  struct random random = {61};
  for (int i = 0; i < 2000000; i++) {
    int32_t a = i < 144 ? corners[i / 12] : (int32_t)random_below(&random, 1u << 31) - (1 << 30);
    int32_t b = i < 144 ? corners[i % 12] : (int32_t)random_below(&random, 1u << 31) - (1 << 30);
    double error = fabs((double)fixed_mul_q30(a, b) - (double)a * (double)b / 1073741824.0);
    worst = error > worst ? error : worst;
  }
  TEST_ASSERT_TRUE(worst < 5.0);
}

/* Against the library, once for the z that the fixed point can hold and once for z itself. */
TEST(test_exp2) {
  double worst = 0.0;
  double worst_all = 0.0;
  for (uint32_t i = 0; i < 4000000; i++) {
    float z = i < 2000000 ? (float)i * (100.0f / 2000000.0f) : (float)(i - 2000000) * 5e-7f;
    double held = floor((double)z * 16777216.0) / 16777216.0;
    double value = (double)fit_exp2_negative(z);
    double error = fabs(value / exp2(-held) - 1.0);
    double error_all = fabs(value / exp2(-(double)z) - 1.0);
    worst = error > worst ? error : worst;
    worst_all = error_all > worst_all ? error_all : worst_all;
  }
  TEST_ASSERT_TRUE(worst < 0x1p-23);
  TEST_ASSERT_TRUE(worst_all < 0x1p-23 + 0.6932 * 0x1p-24);
}

TEST(test_exp2_at_its_ends) {
  TEST_ASSERT_EQUAL_FLOAT(1.0f, fit_exp2_negative(0.0f));
  TEST_ASSERT_EQUAL_FLOAT(1.0f, fit_exp2_negative(-0.0f));
  TEST_ASSERT_EQUAL_FLOAT(1.0f, fit_exp2_negative(-5.0f));
  TEST_ASSERT_EQUAL_FLOAT(1.0f, fit_exp2_negative(-INFINITY));
  TEST_ASSERT_EQUAL_FLOAT(1.0f, fit_exp2_negative(NAN));
  TEST_ASSERT_EQUAL_FLOAT(0.0f, fit_exp2_negative(100.0f));
  TEST_ASSERT_EQUAL_FLOAT(0.0f, fit_exp2_negative(INFINITY));
  for (int whole = 1; whole < 100; whole++) {
    TEST_ASSERT_EQUAL_FLOAT(ldexpf(1.0f, -whole), fit_exp2_negative((float)whole));
    TEST_ASSERT_TRUE(fit_exp2_negative(nextafterf((float)whole, 0.0f)) >= fit_exp2_negative((float)whole));
  }
}

static void log2_error(uint32_t value, double *worst) {
  double error = fabs((double)fit_log2_q24(value) / 16777216.0 - log2((double)value));
  *worst = error > *worst ? error : *worst;
}

TEST(test_log2) {
  double worst = 0.0;
  for (uint32_t value = 1; value < 3000000; value++) {
    log2_error(value, &worst);
  }
  struct random random = {62};
  for (int i = 0; i < 1000000; i++) {
    log2_error(random_u32(&random) | 1u, &worst);
  }
  log2_error(UINT32_MAX, &worst);
  log2_error(UINT32_C(0x80000000), &worst);
  log2_error(INT32_MAX, &worst);
  TEST_ASSERT_TRUE(worst < 2e-4);
  for (uint32_t bit = 0; bit < 32; bit++) {
    TEST_ASSERT_EQUAL_INT32((int32_t)(bit << 24), fit_log2_q24(UINT32_C(1) << bit));
  }
}

TEST(test_fixed_and_float) {
  struct random random = {63};
  for (int i = 0; i < 100000; i++) {
    int q = 2 + (int)random_below(&random, 29);
    int32_t value = (int32_t)(random_u32(&random) >> random_below(&random, 32));
    value = i % 2 ? -(value / 2) : value / 2;
    double exact = ldexp((double)value, -q);
    float found = fit_float(value, -q);
    TEST_ASSERT_TRUE(fabs((double)found - exact) <= fabs(exact) * 0x1p-24);
    /* Of what is a float towards zero. */
    int to = (int)random_below(&random, 31);
    double there = trunc(ldexp((double)found, to));
    there = fmin(fmax(there, -INT32_MAX), INT32_MAX);
    int32_t fixed = fit_fixed(found, to);
    TEST_ASSERT_TRUE(fixed == (int32_t)there);
  }
  TEST_ASSERT_EQUAL_INT32(INT32_MAX, fit_fixed(INFINITY, 0));
  TEST_ASSERT_EQUAL_INT32(-INT32_MAX, fit_fixed(-INFINITY, 0));
  TEST_ASSERT_EQUAL_INT32(0, fit_fixed(0.0f, 30));
  TEST_ASSERT_EQUAL_FLOAT(0.0f, fit_float(0, 20));
  TEST_ASSERT_EQUAL_FLOAT(0.0f, fit_float(1, -200));
  TEST_ASSERT_EQUAL_FLOAT(1e9f, fit_float(1, 40));
  TEST_ASSERT_EQUAL_FLOAT(-1e9f, fit_float(-1, 40));
}
