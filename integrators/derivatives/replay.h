#pragma once
#include "integrators/derivatives/run_gradient.h"
#include "integrators/derivatives/run_instants.h"
#include "integrators/derivatives/second_adjoint.h"

namespace porthos::integrators {

/// A step of a run, as it is handed back.
struct KeptStep {
  std::span<const double> pieces;          ///< StepPieces::numbers()
  std::span<const double> end;             ///< x after it
  std::span<const double> tangent;         ///< δY of its pieces, one after another
  std::span<const double> tangent_at_end;  ///< δx after it; both empty without a direction
  const std::vector<std::int64_t>& turns;  ///< after it
  std::span<const double> instant;         ///< RunInstants::keep(), empty without controllers
};

/// A run whose steps are handed back from the last to the first. Steps that memory does not hold
/// are taken again, from checkpoints at as many levels as it needs. A tangent may go along.
class Replay {
 public:
  virtual ~Replay() = default;

 protected:
  /// The model must outlive it; the options too.
  /// @throws InvalidArgument as StepPieces, make_step_variation() and RunInstants; for a direction
  ///   with sampled controllers
  Replay(const std::string& method, const phs::Model& model, double h,
         const GradientOptions& options);

  /// The end of the run, before the first step back. tangent: δx there, or empty.
  virtual void begin(const phs::State& end, std::span<const double> tangent) = 0;
  /// A step back. @return false: it gave up
  virtual bool back(const KeptStep& step) = 0;

  /// Takes the run and hands it back. @param returns  how many costs go back over each step
  bool take(const phs::State& start, std::int64_t steps, size_t returns);
  /// The length of that run [s].
  double length() const { return length_; }
  /// Before a step, or a step back of one cost: about the same work. false: stopped.
  bool went_on();
  /// false, for a reason.
  bool give_up(Outcome o, const std::string& why);

  const StepPieces& pieces() const { return pieces_; }
  RunInstants& instants() { return instants_; }
  Outcome outcome() const { return outcome_; }
  const std::string& remark() const { return remark_; }

 private:
  /// Where a run can be taken up again with the same bits.
  struct Checkpoint {
    phs::State state;
    std::vector<double> memory, held;
    TwoWords tangent;
  };
  struct TurnsFrom {
    size_t from;  ///< the first step of the segment with them
    std::vector<std::int64_t> turns;
  };

  void plan(std::int64_t steps, const Checkpoint& c);
  size_t row_size(size_t pieces) const;
  size_t pieces_of_a_step(const Checkpoint& first);
  std::int64_t part_of(int level) const;
  std::int64_t forward_steps(std::int64_t steps, int level) const;
  bool reverse(const Checkpoint& from, std::int64_t steps, int level);
  bool forwards(const Checkpoint& from, std::int64_t steps, bool keep);
  bool steps_forwards(std::int64_t steps, bool keep);
  Outcome step_forwards();
  bool tangent_forwards();
  void restore(const Checkpoint& from);
  void keep_step();
  bool hand_back();
  void begin_once(const phs::State& end);

  const GradientOptions& options_;
  StepPieces pieces_;
  Integrator& method_;
  RunInstants instants_;
  std::unique_ptr<StepVariation> along_;   ///< null without a direction
  std::unique_ptr<FieldChange> of_field_;  ///< null without parameters in it
  TwoWords tangent_;
  std::vector<double> tangent_stages_;
  size_t n_, of_piece_ = 0;  ///< of_piece_: numbers of the tangent at a piece's stages

  std::int64_t segment_ = 0, fan_ = 0, done_ = 0, first_ = 0, whole_until_ = 0;
  double work_ = 1, length_ = 0;
  int levels_ = 0;
  phs::State state_, before_;  ///< before_: the last step, with sampled controllers
  std::vector<double> instant_;
  std::vector<double> kept_;  ///< rows of a segment
  std::vector<size_t> rows_;  ///< where they begin
  std::vector<TurnsFrom> turns_;
  bool begun_ = false;
  Outcome outcome_ = Outcome::ok;
  std::string remark_;
};

}  // namespace porthos::integrators
