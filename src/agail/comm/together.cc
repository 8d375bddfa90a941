#include "agail/comm/together.h"

#include <algorithm>
#include <cstdio>
#include <new>

#include "agail/base/error.h"
#include "agail/comm/collectives.h"

namespace agail {

namespace {

JobFailure outcome_of(const std::function<void()>& step) {
  try {
    step();
    return {0, ""};
  } catch (const std::exception&) {
    return current_failure();
  }
}

}  // namespace

JobFailure current_failure() {
  try {
    throw;
  } catch (const InputError& error) {
    return {2, one_line(error.what())};
  } catch (const std::bad_alloc&) {
    return {
        2,
        "there is not enough memory; use smaller batches, layers, minibatches or buffers, fewer "
        "demonstrations, or a machine or container with more"};
  } catch (const std::exception& error) {
    return {1, one_line(error.what())};
  }
}

void together(Communicator& communicator, const std::function<void()>& step) {
  if (communicator.ranks() == 1) return step();
  const JobFailure own = outcome_of(step);
  std::string text(1, static_cast<char>(own.exit_code));
  text += own.message;
  Blocks all;
  allgather(communicator, std::as_bytes(std::span(text)), all);
  int failed = -1;
  bool everywhere = true;
  for (int r = communicator.ranks() - 1; r >= 0; --r) {
    AGAIL_CHECK(!all[r].empty());
    if (all[r].front() != std::byte{0}) failed = r;
    if (!std::ranges::equal(all[r], all[0])) everywhere = false;
  }
  if (failed < 0) return;
  const std::span<const std::byte> told = all[failed];
  const std::string message(reinterpret_cast<const char*>(told.data()) + 1, told.size() - 1);
  throw JobFailure{static_cast<int>(told.front()),
                   everywhere ? message : communicator.name(failed) + ": " + message};
}

void or_abort(Communicator& communicator, const std::function<void()>& work) {
  if (communicator.ranks() == 1) return work();
  const JobFailure failure = outcome_of(work);
  if (failure.exit_code == 0) return;
  std::fprintf(stderr, "agail: %s: %s\n", communicator.name(communicator.rank()).c_str(),
               failure.message.c_str());
  std::fflush(stderr);
  communicator.abort(failure.exit_code);
}

}  // namespace agail
