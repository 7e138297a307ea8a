// Fourier transforms of a field on a square grid, forth and back: each wave times a response.
#pragma once

#include <complex>
#include <memory>
#include <vector>

namespace fingertip::twin {

class Transform {
public:
  explicit Transform(int nodes);
  ~Transform();

  int nodes() const { return nodes_; }
  // Waves (i, j) along x and y, of exp(+i k x): [i * (nodes / 2 + 1) + j], j from 0 to nodes / 2, i as in i_of.
  std::size_t waves() const;
  int i_of(int row) const { return row <= nodes_ / 2 ? row : row - nodes_; }

  // field: [x][y]. The response holds the norm, 1 / nodes^2. The result stays until the next call.
  const double *apply(const std::vector<double> &field, const std::vector<double> &response);
  const double *apply(const std::vector<double> &field, const std::vector<std::complex<double>> &response);
  // The response, real, that answers a 1 at [0][0] alone with this field, which is even.
  std::vector<double> response_of(const std::vector<double> &field);

private:
  template <typename Response> const double *apply_any(const std::vector<double> &field, const Response &response);
  struct Plans;
  int nodes_;
  std::unique_ptr<Plans> plans_;
};

} // namespace fingertip::twin
