#include "command_line.h"

int main(int argc, char** argv) { return agail::command_line(argc, argv); }
