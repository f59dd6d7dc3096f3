#pragma once

namespace pileus {

/// apps/accuracy/report_template.html, which the build puts into the program.
extern const char* const kReportTemplate;

}  // namespace pileus
