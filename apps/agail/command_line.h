// agail: the command line.
#pragma once

namespace agail {

// Returns the exit code: 0 done; 1 our or the machine's failure; 2 the user's input; 128 + signal.
int command_line(int argc, char** argv);

}  // namespace agail
