#include <algorithm>

#include "tests/combinations/features.h"

namespace porthos::test::combinations {

namespace {

using Names = std::vector<std::string>;

Names operator+(Names a, const Names& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

const Names splittings{"splitting strang", "splitting aba864"},
    orbits = Names{"orbit", "drag", "Sun pressure", "Moon"} + splittings,
    controls{"steps time_transformed", "steps reversible"},
    states{"lugre",          "dc_motor",   "drive fixed", "drive torque",
           "drive position", "drive rate", "drive servo"},
    // what damps, and laws that nobody can know not to
    losses{
        "damper",        "friction",   "dry friction",  "controller",      "sampled controller",
        "wheel",         "cmg",        "ball joint",    "soft_latch",      "engage and disengage",
        "contact",       "joint_stop", "rigid contact", "law over joints", "law in Python, tank",
        "whole-body law"},
    canonical{"stormer_verlet", "tao4"}, couplings{"coupling", "close and open"};

}  // namespace

const std::vector<Refusal>& refusals() {
  static const std::vector<Refusal> list{
      {{"fixed base"}, orbits, "What stands on the ground is not in orbit."},
      {{"uniform gravity"},
       orbits,
       "In orbit the field of the planet is what pulls: uniform gravity besides it would count it "
       "twice."},
      {{"fixed base"}, {"torquer"}, "A rod turns the base, and a fixed one does not turn."},
      {canonical, losses,
       "A symplectic map keeps the volume of phase space, which losses contract. These two split a "
       "step between the "
       "derivatives of H, and have no place for what is none."},
      {canonical, states,
       "They move q by the derivative of H by p and p by that by q. A current, or the deflection "
       "of a spring between motor "
       "and joint, is no q and has no p: the structure matrix is not [0 I; -I 0]."},
      {{"splitting aba864"},
       losses + Names{"lugre", "dc_motor", "drive torque", "drive position", "time stepping"},
       "A splitting of order above 2 in the whole step takes parts of it backwards (Sheng 1989, "
       "Suzuki 1991), and "
       "backwards in time losses grow."},
      {{"thruster", "force of pieces"},
       canonical,
       "They jump where they switch. A method with a stage on that instant, or beyond it, sees "
       "the jump on the wrong side, and without a ledger of its own its impulse is not known to "
       "rounding."},
      {controls,
       {"reference solver, cvode_adams", "auto", "time stepping"},
       "The method chooses the steps itself, or a step of one size is what is chosen."},
      {{"steps reversible"},
       {"rk4", "tao4", "radau15"},
       "A reversible control keeps the reversibility a symmetric method has (Hairer, Soderlind "
       "2005). These have none."},
      {controls, orbits,
       "The Kepler flow, the kicks and the internal motion of a step share its size, and the size "
       "goes by the joint rates: "
       "varying kicks are not symplectic, and their error would not cancel along the orbit."},
      {{"reference solver, cvode_adams"},
       {"resume"},
       "What a multistep method knows of its last steps stays inside the library."},
      {{"force of pieces"},
       controls + Names{"auto", "compare", "radau15", "reference solver, cvode_adams"},
       "The force jumps between its pieces, which are whole numbers of steps: steps of other sizes "
       "pass the jumps."},
      {{"sampled controller", "law in Python, tank", "whole-body law"},
       {"compare"},
       "A sampled controller is another system at each size of the step: there is no one motion to "
       "converge to."},
      {couplings + Names{"motion"},
       Names{"gauss16, stages in lanes", "composition", "stormer_verlet", "tao4",
             "discrete gradient", "radau15", "rk4", "reference solver, cvode_adams"},
       "These methods have no multipliers: nothing in them holds a constraint.", true},
      {{"rigid contact", "time stepping"},
       couplings + Names{"motion", "rolling"},
       "An impact would go through the loops as well, and a closed contact press on them: both "
       "need "
       "their rows in one system with those of the contacts, which is not built."},
      {{"dry friction"},
       couplings + Names{"motion", "rolling"},
       "What holds a joint at rest and what holds a loop bear one load together: both need their "
       "rows in one system, which is not built."},
      {{"dry friction"},
       {"rigid contact", "time stepping"},
       "A joint that sticks would take part in an impact, and bear a load with the contacts that "
       "are closed: both need their rows in one system, which is not built."},
      {{"joint_stop"},
       {"time stepping"},
       "A soft stop begins at the touch. Time stepping looks for no instants, so its stops are "
       "rigid "
       "or smooth."},
      {{"steps reversible"},
       {"rolling"},
       "The methods for bodies that roll are not symmetric: they are brought back to the manifold "
       "at "
       "the end of a step."},
      {{"motion", "rolling"},
       {"steps time_transformed"},
       "Transformed time is a coordinate whose momentum is the energy: a motor's power would push "
       "it "
       "at every instant, and what rolls has no Hamiltonian to transform."},
      {{"motion"}, {"lock above"}, "A joint that moves as told does not stop."},
      {{"law over joints", "whole-body law"},
       couplings + Names{"motion", "rolling"},
       "The conditions of the laws are those of trees: a rest point on a loop balances with its "
       "multipliers, which no certificate looks at yet."},
      {{"joint wrench"},
       Names{"rolling", "contact", "rigid contact", "time stepping", "dry friction", "thruster",
             "wrench", "soft_latch", "engage and disengage", "line_spring"},
       "The wrench is what changes the momentum of the bodies behind the joint, less their weight. "
       "What else pulls at them, or closes a loop with them, would have to be taken off it."},
  };
  return list;
}

int refusal_of(const Feature& a, const Feature& b) {
  const auto among = [](const std::vector<std::string>& names, const Feature& f) {
    return std::find(names.begin(), names.end(), f.name) != names.end();
  };
  const auto& list = refusals();
  for (size_t i = 0; i < list.size(); ++i)
    if ((among(list[i].of, a) && among(list[i].with, b)) ||
        (among(list[i].of, b) && among(list[i].with, a)))
      return int(i) + 1;
  return 0;
}

}  // namespace porthos::test::combinations
