#pragma once

#include <lumihull/base/job.h>

#include <functional>
#include <string>
#include <vector>

namespace lumihull::calib {

/// Runs a program to its end and returns its exit status (128 + n where signal n ended it). `line` is called on the
/// caller's thread with each line of its standard output and standard error. job.cancel() ends the program, too.
/// Errors: not_found (no such program), io, cancelled.
int run_child(const std::vector<std::string>& command, Job& job, const std::function<void(const std::string&)>& line);

}  // namespace lumihull::calib
