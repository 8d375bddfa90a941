// Checks of what users read when something is wrong.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "agail/base/error.h"

namespace agail {

// The message of the InputError that `body` throws; it must be one line.
template <class F>
std::string input_error(F&& body) {
  try {
    body();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "no InputError";
  return "";
}

}  // namespace agail
