#pragma once

#include <string>
#include <vector>

#include "lib/scene/scene.h"
#include "pileus/accuracy/analysis.h"

namespace pileus {

/// A diagram ready for the page.
struct Figure {
  std::string caption;
  std::string svg;  ///< as gnuplot wrote it
};

/// report.html: one page that needs no other file and no network.
std::string to_html(const Scene& scene, const AccuracyStudy& study, const AccuracyAnalysis& analysis,
                    const std::vector<Figure>& figures);

/// The same figures as JSON.
std::string to_json(const Scene& scene, const AccuracyStudy& study, const AccuracyAnalysis& analysis);

/// "0.0012 s", "3.4e-05": three digits, as people read them.
std::string short_number(double value);

}  // namespace pileus
