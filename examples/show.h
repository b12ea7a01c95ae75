#pragma once
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "energy_shaping/loop/certificate.h"
#include "scene/plot/trace_plot.h"

/// Prints a certificate and writes certificate.json and plot.svg into the folder given on the
/// command line (default: here).
inline int show(int argc, char** argv, const porthos::energy_shaping::Certificate& certificate,
                const std::string& svg) {
  const std::filesystem::path folder = argc > 1 ? argv[1] : ".";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "certificate.json") << certificate.json();
  std::ofstream(folder / "plot.svg") << svg;
  std::fputs(certificate.text().c_str(), stdout);
  return certificate.holds() ? 0 : 1;
}
