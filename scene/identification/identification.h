#pragma once
#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "scene/identification/log.h"
#include "scene/sensitivity/unknowns.h"

/// Parameters of a scene from a log of its motion: docs/identification.md.
namespace porthos::scene {

/// A fit on its way.
struct FitProgress {
  int iterations = 0, runs = 0;
  double until = 0;        ///< [s] of the log, from its beginning
  double mean_square = 0;  ///< of (run - log)/σ
};

/// What to find.
struct IdentificationRequest {
  std::vector<std::string> parameters;  ///< names as in Unknowns
  LogNoise noise = {};
  int iterations = 50;                                ///< at most
  const std::atomic<bool>* stop = nullptr;            ///< true: give up
  std::function<void(const FitProgress&)> tell = {};  ///< after each iteration
  /// Gets what is told before: notes on the model.
  std::function<void(const std::string& line)> say = {};
};

/// A parameter as the log tells it.
struct Found {
  Unknown of;
  double value = 0;
  /// 1σ in its unit by the covariance; NaN: the log tells nothing of it.
  double deviation = 0;
};

/// A combination of parameters, from the singular value decomposition of the Jacobian.
struct Combination {
  double deviation = 0;  ///< 1σ along it, of z; infinite: the log tells nothing of it
  bool told = true;      ///< whether that is less than a whole change
  /// The change of each parameter along it, over Unknown::scale; the largest is 1.
  std::vector<double> moves;
};

/// How well a run agrees with a column of the log.
struct Agreement {
  Observed of;
  double sigma = 0;              ///< 0: not known
  double before = 0, after = 0;  ///< root mean square of run - log, at the start and as found
};

/// Parameters found from a log.
struct Identification {
  std::string title, log, method;
  double step = 0;  ///< [s]
  std::vector<double> times;
  std::vector<Found> found;
  std::vector<double> covariance;         ///< of the values, n · n, row by row
  std::vector<Combination> combinations;  ///< best told first
  std::vector<Agreement> columns;
  std::vector<std::vector<double>> before,
      after;                         ///< (run - log)/σ by column, at the start, as found
  double chi_square = 0, noise = 1;  ///< noise: 1, or as estimated by the residuals
  size_t freedoms = 0;               ///< numbers of the log less parameters
  /// How far half the step would move the values found, in 1σ, along the combination where it is
  /// most; NaN if that run fails.
  double step_error = 0;
  /// The fit began with bodies by least squares of their momenta (docs/identification.md).
  bool by_momenta = false;
  int iterations = 0, runs = 0, runs_with_tangents = 0, refused = 0;
  std::vector<std::vector<double>> iterates;  ///< values of every accepted step, the start first
  /// Whether the fit came to its end, nearer to the log than the start; a note says why not.
  bool converged = false;
  std::string failure;  ///< of the run from the scene's values; then nothing is found
  std::vector<std::string> notes;
  std::string scene;  ///< text of the scene with the values found, for the folder of the scene

  bool noise_known() const { return !columns.empty() && columns.front().sigma > 0; }
  /// How far χ² is from its expectation, in its standard deviations: beyond 3 the model or σ is
  /// wrong. Source: Wilson, Hilferty 1931, PNAS 17.
  double surprise() const;
};

/// Fits parameters so that the run of a scene has what a log says at its times, in least squares
/// over the whole run (output error). The start is the scene's, or, where the log has all rates and
/// that run is nearer to it, what the momenta tell of the bodies. The run lasts as long as the log.
/// Each iteration costs a run and a run with a tangent for each parameter.
/// @param log  path of the file, as read_log()
/// @throws InvalidArgument as differentiable_steps(), phs::linearise(), Unknowns, read_log(); for
///   [[actuator]]s whose motors move, for times in ms and rates in degrees that show it, and for a
///   log with fewer numbers than parameters
Identification identify(const Scene& scene, const std::string& log,
                        const IdentificationRequest& request);
/// The same from columns.
Identification identify(const Scene& scene, const NamedColumns& log,
                        const IdentificationRequest& request);

/// The table with its combinations and notes.
std::string identification_text(const Identification& r);
/// identify.json.
std::string identification_json(const Scene& scene, const Identification& r);
/// Writes identify.json, .txt, .svg, and found.toml, the scene with the values found. @throws
/// IoError
void write_identification(const std::string& folder, const Scene& scene, const Identification& r);

}  // namespace porthos::scene
