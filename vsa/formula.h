#pragma once
#include <map>
#include <string>

#include "vsa/elastic.h"

namespace porthos::vsa {

/// An energy of the user's own as a text, "0.5*(k0 + k1*sigma^2)*phi^2 + a*phi^4". phs::Formula
/// describes its language.
struct Formula {
  std::string energy;                        ///< [J] of phi = q - θ [rad], sigma, parameters
  std::map<std::string, double> parameters;  ///< by name, each in the energy
};

/// Torque, stiffness and the effort of the stiffness port are its exact derivatives.
///
/// The limits state where it holds: the deflection up to ± its limit, or ± π if there is none, and
/// the range of σ, which must be finite if the energy depends on σ. There, at each of 201
/// deflections times 21 σ, the energy and its first and second derivatives must be finite, and the
/// stiffness not negative. Between these places poles of the stiffness are looked for, at the
/// middle and the ends of the range of σ. Cost of making it: about 4 ms.
///
/// @throws InvalidArgument for what is no formula, an energy that does not depend on phi, no range
/// of σ, a place where the energy does not meet these conditions, or a pole
ElasticPtr formula(const Formula& p, const Limits& l = {});

}  // namespace porthos::vsa
