// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/command.h"

int main(int argc, char** argv)
{
    return gsc::runGsc(argc, argv);
}
