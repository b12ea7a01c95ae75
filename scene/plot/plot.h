#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "scene/plot/trace_plot.h"

namespace porthos::scene {

struct RunReport;

/// One column of a decimated series: range of |error| and root mean square up to it.
struct EnvelopePoint {
  double t = 0, low = 0, high = 0, rms = 0;
};

/// Decimates a series of (t, error) to at most 1500 columns, equally wide on the axis, in constant
/// memory.
class Envelope {
 public:
  /// first: time of the first record after 0; the axis is logarithmic when last/first > 100.
  /// from: where the axis begins, if the picture is of a part of the run.
  Envelope(double first, double last, double from = 0);
  /// Adds errors in order of time. t = 0 has no place on a logarithmic axis and is left out of the
  /// picture.
  void add(double t, double error);
  bool logarithmic() const { return logarithmic_; }
  double from() const { return from_; }
  double first() const { return first_; }
  double last() const { return last_; }
  const std::vector<EnvelopePoint>& points() const { return points_; }

 private:
  double from_, first_, last_;
  bool logarithmic_;
  int column_ = -1;
  double sum_of_squares_ = 0, count_ = 0;
  std::vector<EnvelopePoint> points_;
};

/// "residual [relative]": the relative energy error as a band, its root mean square so far, √t
/// through the end of that, and the limit of the verdict.
TracePanel residual_panel(const Envelope& envelope, std::optional<double> limit);

/// The line below the title of a run's pictures: method, step, cost, verdict.
std::string plot_subtitle(const RunReport& report);

}  // namespace porthos::scene
