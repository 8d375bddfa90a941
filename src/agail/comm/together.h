// Failures that all ranks must know of.
#pragma once

#include <functional>
#include <string>

#include "agail/comm/communicator.h"

namespace agail {

// What together() throws on every rank. Rank 0 prints it.
struct JobFailure {
  int exit_code;
  std::string message;
};

// What the exception that is being handled means: exit code 2 for an InputError or too little
// memory, else 1; a message of one line.
JobFailure current_failure();

// Runs `step`, which must not exchange anything, on every rank; if it fails on any, all ranks throw
// JobFailure as current_failure() has it, with the rank's name if only some ranks fail. The only
// rank's exceptions pass as they are.
void together(Communicator& communicator, const std::function<void()>& step);

// Runs `work`, which may exchange; a failure is printed with the rank's name and ends all ranks.
// The only rank's exceptions pass as they are.
void or_abort(Communicator& communicator, const std::function<void()>& work);

}  // namespace agail
