#pragma once
#include <memory>
#include <string>
#include <vector>

#include "energy_shaping/loop/closed_loop.h"
#include "energy_shaping/loop/run.h"
#include "energy_shaping/matching/matched_loop.h"

namespace porthos::energy_shaping {

/// A critical point of V_d.
struct CriticalPoint {
  std::vector<double> q;
  double value = 0;    ///< V_d
  int descending = 0;  ///< directions in which V_d falls: 0 a minimum, 1 a saddle
  /// Coordinates along which V_d is flat there: points next to it are critical as well.
  std::vector<std::size_t> flat = {};
  bool again = false;  ///< flat as another point of the same V_d, which is not `again`
};

/// Critical points of V_d(q) = H_d(q, 0) inside the region, by Newton's method from `starts` points
/// of it, ordered by value. Points that no start leads to are not found.
/// @throws InvalidArgument for a region without the rest point inside
std::vector<CriticalPoint> critical_points(const ClosedLoop& loop, const Region& region,
                                           int starts = 400);

/// A level c such that the component of {V_d < c} around the rest point neither leaves the region
/// nor has another critical point in it.
struct Basin {
  double level = 0, depth = 0;  ///< c, and c - V_d(q*)
  std::vector<double> at;       ///< where it would leave
  std::string method;
};
/// Up to 3 coordinates: flood fill from the rest point over a grid. It finds the lowest saddle on
/// any path to the region's boundary or to another of the critical points found by
/// critical_points(). The saddle is refined by Newton's method; on the boundary it is lowered by
/// the second differences of the grid. The level is at most that of each pass of critical_points()
/// that the component reaches; another saddle narrower than the grid is missed.
/// @throws InvalidArgument for more coordinates, and a region without the rest point inside
Basin basin(const ClosedLoop& loop, const Region& region, int cells = 0);

/// Where a closed loop is checked, and how closely.
struct CertifyOptions {
  Region region;                                 ///< of coordinates and rates to check
  std::vector<std::vector<double>> starts = {};  ///< states that runs start from
  std::vector<double> periods = {0};  ///< of the controller in those runs [s]; 0: continuous
  RunOptions run = {};                ///< duration, step, method, limits
  double settled =
      1e-2;  ///< a run has settled if H_d - H_d(rest) came down to this part of its start
  /// The same plant with other parameters: each is run from each start under the original law.
  std::vector<std::shared_ptr<const phs::Model>> plants = {};
};

/// The certificate of the constructor, and: H_d' against the formula, linearised eigenvalues,
/// critical points and basin (up to 3 coordinates), H_d of each start against it, inputs on the
/// basin, runs of the plant as sampled, and with other parameters. Limits of the inputs act in the
/// runs; the shares of them that the runs and the basin take are told.
/// @throws InvalidArgument for no samples, for periods or plants without starts, for limits and
///   starts that do not fit the loop or for which the law is not meant (ClosedLoop::hindrance),
///   and, up to 3 coordinates, for a region without the rest point inside or with ends for which it
///   is not meant
Certificate certify(const ClosedLoop& loop, const CertifyOptions& options);

}  // namespace porthos::energy_shaping
