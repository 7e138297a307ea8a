#include "libfingertip/progress_bar.hpp"

#include <gtest/gtest.h>

TEST(ProgressBar, SaysTheTimeLeftAboveOnePercent) {
  testing::internal::CaptureStderr();
  fingertip::ProgressBar bar("reading");
  for (double share : {0.0, 0.0, 0.01, 0.02, 0.5, 1.0}) {
    bar.show(share);
    bar.show(share); /* without a terminal there is a line each ten seconds */
    fingertip::wait_until(fingertip::host_now() + std::chrono::seconds(10));
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "reading 0 %\nreading 1 %\nreading 2 %, 1470 s left\nreading 50 %, 40 s left\nreading 100 %, 0 s left\n");
}
