// SPDX-License-Identifier: Apache-2.0
#include <gsc/interrupt.h>
#include "player/commands/commands.h"

int main(int argc, char** argv)
{
    gsc::installInterruptHandler();
    return gsc::runGscPlay(argc, argv);
}
