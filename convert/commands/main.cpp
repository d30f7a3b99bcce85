// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/command.h"
#include <gsc/interrupt.h>

int main(int argc, char** argv)
{
    gsc::installInterruptHandler();
    return gsc::runGsc(argc, argv);
}
