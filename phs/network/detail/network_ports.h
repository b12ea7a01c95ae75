#pragma once
#include <string>
#include <vector>

#include "phs/network/detail/network_plan.h"

/// How the parts of a Network find ports by name and check them. Private to network*.cpp.
namespace porthos::phs {

[[noreturn]] void refuse(const Network::Plan& p, const std::string& why);

/// A port of a member, found by "<member>.<port>", or the component k of one that has several,
/// found by "<member>.<port>[k]".
struct FoundPort {
  std::string name;
  const Network::Plan::Member* member;
  Port port;
  int row;  ///< of its first input
};

/// @throws InvalidArgument that lists the known ports
FoundPort find_port(const Network::Plan& p, const std::string& name);
/// The same, with `row` at one component of the port.
FoundPort find_component(const Network::Plan& p, const std::string& name, int component);

/// The input rows of the ports, concatenated.
std::vector<int> rows_of(const std::vector<FoundPort>& ports);
/// @throws InvalidArgument for the name of another element, or none
void require_new_name(const Network::Plan& p, const std::string& name);
/// The number of a tank that `of` names; -1 for no name. @throws InvalidArgument for an unknown one
int find_tank(const Network::Plan& p, const std::string& of, const std::string& name);
/// Requires that m is n x n and finite.
void require_square(const Network::Plan& p, const Matrix& m, size_t n, const std::string& what);

/// The state-dependent inputs and the outputs they depend on, in one list.
std::vector<int> coupled_rows(const Network::Plan& p);
/// How many numbers springs push.
size_t spring_numbers(const Network::Plan& p);

}  // namespace porthos::phs
