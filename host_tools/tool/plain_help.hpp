/* Help and wrong usage, as all programs of the tool print them. */
#pragma once

namespace CLI {
class App;
}

namespace fingertip {

/* Help within 80 columns, which cuts no word; what is wrong in one line, which names the help. */
void speak_plainly(CLI::App &app);

} // namespace fingertip
