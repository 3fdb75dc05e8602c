# SPDX-License-Identifier: Apache-2.0
# Start-up file of the shell that `make shell` opens.
if [ -f ~/.bashrc ]; then
  . ~/.bashrc
fi
# Once more, since ~/.bashrc may have put other directories in front.
. "$WORKSPACE_ROOT/.venv/activate_workspace.sh"
PS1="(intersection) ${PS1-\w\$ }"
