#include "simulation/twin/transform.hpp"

#include <algorithm>
#include <fftw3.h>
#include <mutex>

namespace fingertip::twin {

// Planning in FFTW is not safe in several threads.
static std::mutex planning;

static void multiply(fftw_complex &wave, double by) {
  wave[0] *= by;
  wave[1] *= by;
}

static void multiply(fftw_complex &wave, const std::complex<double> &by) {
  const std::complex<double> product = by * std::complex<double>(wave[0], wave[1]);
  wave[0] = product.real();
  wave[1] = product.imag();
}

struct Transform::Plans {
  double *real;
  fftw_complex *spectrum;
  fftw_plan forward, backward;
};

Transform::Transform(int nodes) : nodes_(nodes), plans_(std::make_unique<Plans>()) {
  Plans &p = *plans_;
  p.real = fftw_alloc_real(std::size_t(nodes) * std::size_t(nodes));
  p.spectrum = fftw_alloc_complex(waves());
  const std::lock_guard<std::mutex> lock(planning);
  p.forward = fftw_plan_dft_r2c_2d(nodes, nodes, p.real, p.spectrum, FFTW_ESTIMATE);
  p.backward = fftw_plan_dft_c2r_2d(nodes, nodes, p.spectrum, p.real, FFTW_ESTIMATE);
}

Transform::~Transform() {
  const std::lock_guard<std::mutex> lock(planning);
  fftw_destroy_plan(plans_->forward);
  fftw_destroy_plan(plans_->backward);
  fftw_free(plans_->real);
  fftw_free(plans_->spectrum);
}

std::size_t Transform::waves() const { return std::size_t(nodes_) * std::size_t(nodes_ / 2 + 1); }

template <typename Response> const double *Transform::apply_any(const std::vector<double> &field, const Response &response) {
  std::copy(field.begin(), field.end(), plans_->real);
  fftw_execute(plans_->forward);
  for (std::size_t n = 0; n < waves(); n++) {
    multiply(plans_->spectrum[n], response[n]);
  }
  fftw_execute(plans_->backward);
  return plans_->real;
}

const double *Transform::apply(const std::vector<double> &field, const std::vector<double> &response) { return apply_any(field, response); }

const double *Transform::apply(const std::vector<double> &field, const std::vector<std::complex<double>> &response) {
  return apply_any(field, response);
}

std::vector<double> Transform::response_of(const std::vector<double> &field) {
  std::copy(field.begin(), field.end(), plans_->real);
  fftw_execute(plans_->forward);
  std::vector<double> response(waves());
  for (std::size_t n = 0; n < waves(); n++) {
    response[n] = plans_->spectrum[n][0] / static_cast<double>(field.size());
  }
  return response;
}

} // namespace fingertip::twin
